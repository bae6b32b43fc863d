{# Statements: the `index` and the `place` of an invocation's pixel, among listed pixels or all. #}
{% if listed %}
    if id.x >= lists[work.view.number].count { return; }
    let index = listed_pixels[first_listed() + id.x];
    let place = place_of(index);
{% else %}
    let place = pixel_at(id);
    if any(place >= work.view.size_px) { return; }
    let index = work.view.first_pixel + place.y * work.view.size_px.x + place.x;
{% endif %}
