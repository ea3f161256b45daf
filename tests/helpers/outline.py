"""What a page holds, element by element."""

from html.parser import HTMLParser

from comparison.report.page import render
from comparison.verdict.results import SceneComparison

VOID = {"meta", "link", "br", "img", "hr", "input", "path", "rect", "use"}


class Outline(HTMLParser):
    """Elements in order, with what is open around them; wrong nesting is an error."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open and "script" not in self.open:
            self.text.append(data)


def words(html: str) -> str:
    return " ".join(" ".join(Outline(html).text).split())


def page(*scenes: SceneComparison) -> str:
    return render(scenes, title="Press", command="sixbar validate")
