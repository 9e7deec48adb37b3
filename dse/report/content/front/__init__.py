"""A front as pages: what its writers set, made once.

Read `first_screen.py` first, then `pages.py`.

* `first_screen.py`: warnings, proof, a row for each kind of design, the recommendation.
* `pages.py`: the longer pages for a terminal and for Markdown.
* `document.py`: everything that is said of a front and of each design.
* `decision.py`: the first screen of the HTML page: banner, cards, latencies by cause, limits.
* `filters.py`: the data of the page's filters, and the price of insisting on an option.

Not allowed here: HTML, Markdown or terminal codes.
"""
