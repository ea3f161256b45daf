"""A package with models where Python may find it, as an installer would leave it."""


def write_package(site, module, source, points, version="1"):
    """Write a module with its entry points, by model, into a folder, and return its path."""
    info = site / f"{module}.dist-info"
    info.mkdir(parents=True, exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: {version}\n")
    lines = "".join(f"{name} = {target}\n" for name, target in points.items())
    (info / "entry_points.txt").write_text(f"[sixbar.models]\n{lines}")
    (site / f"{module}.py").write_text(source)
    return site / f"{module}.py"
