"""Reports of comparisons: a self-contained HTML page, JUnit XML, Markdown, pictures."""
