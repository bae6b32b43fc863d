//! The reason of a choice, in plain words.

use super::Planner;
use crate::budget::{ErrorTerm, Statistic};
use crate::costs::Pricing;
use crate::outcome::{Choice, PromiseState};

impl<P: Pricing> Planner<P> {
    pub(super) fn reason(&self, choice: Choice, state: PromiseState, is_spent: bool) -> String {
        let spent = match (state, is_spent) {
            (PromiseState::Measuring, _) => {
                format!(" Measuring has taken {:.1} of {:.1} s.", self.spent_s, self.allowance_s)
            }
            (_, true) => format!(" Measuring ended early: its allowance of {:.1} s is spent.", self.allowance_s),
            (_, false) => String::new(),
        };
        format!("{}{spent}", self.finding(choice, state, is_spent))
    }

    fn finding(&self, choice: Choice, state: PromiseState, is_spent: bool) -> String {
        let measured = self.rows.iter().filter(|row| !row.errors.is_empty()).count();
        let of = format!("{measured} of {} rows were measured", self.rows.len());
        match (state, choice) {
            (PromiseState::Measuring, _) => format!("{}: {of}.", self.request.budget),
            (PromiseState::Kept, Choice::Row(row)) => self.row_keeps(row, &of),
            (PromiseState::Kept, Choice::Direct) => self.direct_keeps(&of),
            (PromiseState::Unreachable, _) => self.unreachable(choice, is_spent),
        }
    }

    fn row_keeps(&self, row: usize, of: &str) -> String {
        let price = self.prices[row];
        let error = match (self.term(), self.certificate_of(Choice::Row(row))) {
            (Some(term), Some(certificate)) => format!(
                "{}: {} {}, at most {} with 95 % confidence, on {} views",
                self.request.budget,
                term.metric(),
                term.shown(certificate.expected_ratio),
                term.shown(certificate.bound_ratio),
                certificate.views,
            ),
            _ => format!("{}: the least FLIP, {:.4}", self.request.budget, self.error_ratio(row)),
        };
        format!(
            "{} keeps {error}. It costs {} a view and takes {}; {}. {of}.",
            self.row(row),
            ms(price.node_s),
            ms(price.view_s),
            self.direct_costs(),
        )
    }

    fn direct_costs(&self) -> String {
        match self.pricing.direct().node_s {
            node_s if node_s.is_finite() => format!("direct costs {}", ms(node_s)),
            _ => "views may not be drawn directly".to_owned(),
        }
    }

    fn direct_keeps(&self, of: &str) -> String {
        let nearest = match (self.term(), self.nearest_to_error()) {
            (Some(term), Some(row)) => {
                format!(" The row with the least error, {}, has {}.", self.row(row), shown(term, self.error_ratio(row)))
            }
            _ => String::new(),
        };
        format!(
            "Direct drawing keeps {} at {} a view; no cheaper row is certified to.{nearest} {of}.",
            self.request.budget,
            ms(self.pricing.direct().node_s),
        )
    }

    /// By how much the budget is missed, or that too little was measured to know.
    fn unreachable(&self, choice: Choice, is_spent: bool) -> String {
        let over = self.over(choice);
        let nearest = match (self.term(), self.nearest_to_error()) {
            (Some(term), Some(row)) => {
                let in_time = if self.request.budget.most_view_s().is_some() { "In time, " } else { "" };
                format!(" {in_time}{} has the least error: {}.", self.row(row), shown(term, self.error_ratio(row)))
            }
            _ => String::new(),
        };
        let name = match choice {
            Choice::Row(row) => self.row(row).to_string(),
            Choice::Direct => "Direct drawing".to_owned(),
        };
        let keeps = if is_spent { "is known to keep" } else { "keeps" };
        format!("Nothing {keeps} {}. {name} {over}.{nearest}", self.request.budget)
    }

    fn over(&self, choice: Choice) -> String {
        let view_s = self.price_of(choice).view_s;
        match self.request.budget.most_view_s() {
            Some(limit_s) if view_s.is_finite() => {
                format!("takes {} a view, {} too long", ms(view_s), ms(view_s - limit_s))
            }
            _ if choice == Choice::Direct => "is not allowed".to_owned(),
            _ => format!("comes nearest; {}", self.direct_costs()),
        }
    }
}

fn shown(term: ErrorTerm, ratio: f64) -> String {
    let views = if term.statistic() == Statistic::P95 { "in 95 of 100 views" } else { "in the mean" };
    format!("{} {} {views}", term.metric(), term.shown(ratio))
}

fn ms(seconds: f64) -> String {
    format!("{:.3} ms", seconds * 1e3)
}
