"""Answers as pages: terminal, Markdown, HTML, and pictures.

Read `page.py` first: a page of sections, made once and set by three writers.

* `page.py`, `dispatch.py`: the page model; the page of any answer.
* `terminal.py`, `markdown.py`, `html.py`: the three writers; `templates/` belongs to HTML.
* `output.py`, `picture.py`, `widget.py`: reports and pictures in files; one plot; a page in a notebook.
* `content/`: one file for the page of each verb.
* `words/`, `amounts.py`: sentences about one subject; differences, slacks and shares in words.
* `plots/`: plots, drawn as SVG.
* `text_table.py`: plain tables, for terminals without UTF-8 too.

Not allowed here: options and exit codes (`cli`), click, a search, a formula of a metric. A sentence or figure is made
once, in the page, for all writers.
"""
