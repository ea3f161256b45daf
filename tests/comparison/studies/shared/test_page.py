"""A README and its figures in one HTML file."""

from __future__ import annotations

import re

from comparison.studies.shared.page import single_page


def test_the_page_holds_the_figures_and_shows_html_as_text(tmp_path):
    (tmp_path / "figure-1.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0"/></svg>')
    readme = tmp_path / "README.md"
    readme.write_text(
        "# Title & <b>\n\n[to](figure-1.svg) [it](#the-runs)\n\n## The runs\n\n"
        '| a |\n|---|\n| <script>x</script> |\n\n![Fig. 1: "x" < y](figure-1.svg)\n'
    )
    single_page(readme, tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text("utf-8")
    assert "<title>Title &amp; &lt;b&gt;</title>" in html
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert '<figure id="figure-1">' in html
    assert '<path d="M0 0"/>' in html
    assert "<img" not in html
    assert "<td>" in html
    assert 'href="#figure-1"' in html
    assert 'href="#the-runs"' in html
    assert '<h2 id="the-runs">' in html
    assert re.search(r"<figcaption>Fig. 1: &quot;x&quot; &lt; y</figcaption>", html)
