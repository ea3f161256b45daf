"""Elements of a page, one by one."""

from html.parser import HTMLParser

from comparison.report.page import render

VOID = {"meta", "link", "br", "img", "hr", "input", "path", "rect", "use"}


class Outline(HTMLParser):
    """Elements in order, with the open ones around them; wrong nesting is an error."""

    def __init__(self, text):
        super().__init__()
        self.open = []
        self.elements = []
        self.text = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open and "script" not in self.open:
            self.text.append(data)


def words(html):
    return " ".join(" ".join(Outline(html).text).split())


def page(*scenes):
    return render(scenes, title="Press", command="sixbar validate")
