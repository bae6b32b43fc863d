use super::*;

/// The largest messages.
const FAST_S: f64 = 1e-6;

/// A queue of sets with these numbers of views, all in cell 0. A view is its number.
fn queue(sets: &[usize], weights: &[u32], view_s: f64) -> ViewQueue<usize> {
    let mut queue = ViewQueue::new(weights, view_s);
    let mut first = 0;
    for (set_index, &views) in (0..).zip(sets) {
        queue.push(set_index, (first..first + views).map(|view| (0, view)).collect());
        first += views;
    }
    queue
}

/// The time of compositors that need `view_s` for a view, and the views of each.
struct Run {
    free_s: Vec<f64>,
    views: Vec<Vec<usize>>,
}

/// Asks all compositors in turns, and then whichever delivers first.
fn run(queue: &mut ViewQueue<usize>, view_s: &[f64]) -> Run {
    let mut run = Run { free_s: vec![0.0; view_s.len()], views: vec![Vec::new(); view_s.len()] };
    let mut requested = vec![VecDeque::new(); view_s.len()];
    let mut has_asked = true;
    while has_asked {
        has_asked = false;
        for (at, requested) in requested.iter_mut().enumerate() {
            let message = queue.next_message(at);
            has_asked |= message.is_some();
            requested.extend(message.into_iter().flat_map(|message| message.views));
        }
    }
    while let Some(next) = next_to_deliver(&requested, &run.free_s, view_s) {
        run.free_s[next] += view_s[next];
        run.views[next].extend(requested[next].pop_front());
        queue.received(next, run.free_s[next], false);
        while let Some(message) = queue.next_message(next) {
            requested[next].extend(message.views);
        }
    }
    run
}

fn next_to_deliver(requested: &[VecDeque<usize>], free_s: &[f64], view_s: &[f64]) -> Option<usize> {
    let busy = (0..requested.len()).filter(|&at| !requested[at].is_empty());
    busy.min_by(|&a, &b| f64::total_cmp(&(free_s[a] + view_s[a]), &(free_s[b] + view_s[b])))
}

fn all_views(run: &Run) -> Vec<usize> {
    let mut all = run.views.concat();
    all.sort_unstable();
    all
}

#[test]
fn equal_compositors_make_equal_shares_of_every_set() {
    let mut queue = queue(&[40, 40], &[1, 1], FAST_S);
    for (set_index, compositor, views) in [(0, 0, 0..20), (0, 1, 20..40), (1, 0, 40..60), (1, 1, 60..80)] {
        let expected = Message { set_index, views: views.collect() };
        assert_eq!(queue.next_message(compositor), Some(expected));
    }
    assert_eq!((queue.waiting(), queue.next_message(0)), (0, None));
}

#[test]
fn two_messages_of_views_are_in_flight() {
    let mut queue = queue(&[100], &[1], 0.02);
    let message = |queue: &mut ViewQueue<usize>| queue.next_message(0).map(|message| message.views.len());
    assert_eq!([message(&mut queue), message(&mut queue), message(&mut queue)], [Some(12), Some(12), None]);
    (1..12).for_each(|_| queue.received(0, 0.0, false));
    assert_eq!(message(&mut queue), None);
    queue.received(0, 0.0, false);
    assert_eq!((message(&mut queue), queue.in_flight(0)), (Some(12), 24));
    (0..30).for_each(|_| queue.received(0, 0.0, false));
    assert_eq!((queue.in_flight(0), queue.in_flight(7)), (0, 0), "nobody asked for these");
}

#[test]
fn a_slow_compositor_does_not_delay_the_batch() {
    for weights in [[1; 4], [4, 4, 4, 1]] {
        let view_s = [0.01, 0.01, 0.01, 0.04];
        let run = run(&mut queue(&[400; 3], &weights, 0.01), &view_s);
        assert_eq!(all_views(&run), (0..1200).collect::<Vec<_>>());
        let even_s: f64 = 1200.0 / view_s.iter().map(|view_s| 1.0 / view_s).sum::<f64>();
        let last_s = run.free_s.iter().copied().fold(0.0, f64::max);
        // By equal shares it would be 12 s; 8 views of the slow node are 0.32 s.
        assert!(last_s < even_s + 0.32 && even_s < 3.7, "{last_s} {even_s}");
    }
}

#[test]
fn equal_compositors_end_together() {
    for (sets, compositors) in [(vec![3; 20], 2), (vec![19; 7], 11), (vec![100; 12], 4), (vec![64], 3)] {
        let views: usize = sets.iter().sum();
        let run = run(&mut queue(&sets, &vec![7; compositors], FAST_S), &vec![0.1; compositors]);
        let most = run.views.iter().map(Vec::len).max();
        assert!(most <= Some(views.div_ceil(compositors) + 1), "{sets:?} by {compositors}: {most:?}");
    }
}

#[test]
fn a_compositor_that_would_make_less_than_half_a_view_is_not_asked() {
    let mut queue = queue(&[40], &[99, 1, 0], FAST_S);
    assert_eq!((queue.next_message(1), queue.next_message(2)), (None, None));
    let run = run(&mut queue, &[0.01, 1.0, 1.0]);
    assert_eq!(run.views.iter().map(Vec::len).collect::<Vec<_>>(), [40, 0, 0]);
}

#[test]
fn a_compositor_stays_in_its_view_cell_and_then_takes_of_the_largest() {
    let mut queue = ViewQueue::new(&[1, 1], 0.02);
    queue.push(5, (0..80).map(|view| (view % 2, view)).collect());
    let mut cells = [Vec::new(), Vec::new()];
    while queue.waiting() > 0 {
        for (compositor, cells) in cells.iter_mut().enumerate() {
            let Some(message) = queue.next_message(compositor) else { continue };
            assert!(message.set_index == 5 && message.views.is_sorted());
            cells.extend(message.views.iter().map(|view| view % 2));
            message.views.iter().for_each(|_| queue.received(compositor, 0.0, false));
        }
    }
    let [first, second] = cells;
    assert!(first.len() <= 44 && first[..40] == [0; 40], "{first:?}");
    assert!(second.iter().all(|cell| *cell == 1), "{second:?}");
}

#[test]
fn every_view_is_requested_once_for_any_weights_and_sets() {
    for weights in [vec![0, 0, 0], vec![5, 1, 0], vec![1], vec![65_535, 7, 1, 1]] {
        for sets in [vec![0], vec![1], vec![7, 1, 300], vec![2, 2, 2]] {
            let mut queue = queue(&sets, &weights, 0.03);
            let run = run(&mut queue, &vec![0.01; weights.len()]);
            assert_eq!(all_views(&run), (0..sets.iter().sum()).collect::<Vec<_>>(), "{weights:?} {sets:?}");
            assert_eq!(queue.waiting(), 0);
        }
    }
    assert_eq!(queue(&[3], &[1], FAST_S).next_message(7), None, "no such compositor");
}
