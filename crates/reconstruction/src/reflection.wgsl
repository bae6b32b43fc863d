// What surfaces reflect of the lights of a view.
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "light.wgsl" %}
{% include "highlight.wgsl" %}
@group(0) var<uniform> illumination: Illumination;
