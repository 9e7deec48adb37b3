"""The architecture of a problem, or of one of its designs, as SVG, without a browser or a layout library.

Read `parts.py` first.

* `parts.py`: areas of threads, links, uses of buses, flows: what is drawn, whatever the design.
* `texts.py`: what stands in boxes and bars: activations, types, ranges of open options.
* `layout.py`: a layered drawing of a graph; items in a row kept apart.
* `places.py`: where areas, bars, devices and lines stand.
* `picture.py`: the SVG.

Not allowed here: a figure of its own; a place that depends on the design, so that two designs can be compared by eye.
"""
