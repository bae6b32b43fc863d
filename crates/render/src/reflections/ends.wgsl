// Points where rays end, or that are listed, and the light that has arrived there.
{% include "reflections/bounce.wgsl" %}
@group(0) var<storage, read> bounces: array<Bounce>;
@group(0) var<storage, read> list: BounceList;
@group(0) var<storage, read> sums: array<f32>;
{% include "sums.wgsl" %}
{% if visibility %}

{% include "visibility.wgsl" %}
{% endif %}
