"""Bad command lines and scenes: exit code 2, one line with place, value and rule, and nothing written."""

import pytest

RUN = "run ideal --model reference --out new.csv"
GRID = "study sweep ideal --grid drive.speed_rpm=100"
LATIN = "study sweep ideal --latin drive.cycles"
COMPARE = "compare x.csv y.csv"
FLORES = "plan 150rpm-0.2mm --set contact.damping_model=flores"
MANY = ",".join(["1"] * 1001)
LISTS = {
    "short": "drive.speed_rpm,contact.law\n100\n",
    "head": "drive.speed_rpm\n",
    "twice": "a.b,a.b\n1,2\n",
}
MISTAKES = {
    "swim": "'swim'",
    "plan ideal --nope": "--nope|sixbar plan --help",
    "scenes extra": "extra",
    "channels nowhere": "'nowhere'|150rpm-0.2mm|wedge",
    "plan idael": "'idael'|did you mean 'ideal'",
    "new a.toml --from nowhere": "'nowhere' is neither|wedge|squeezer",
    "keys stifness": "'stifness'|did you mean contact.stiffness?",
    "new a.json": "a.json|.toml",
    "new a+/\u00e9.toml": "\u00e9.toml|letters",
    "run ideal": "--model",
    "run ideal --model adams --out new.csv": "'adams'|reference, exudyn",
    "run ideal --model reference --out a.xls": "a.xls|.csv or .parquet",
    "run ideal --model reference --out dangling.csv": "dangling.csv: |link",
    "run ideal --model reference --out ~nosuchuser/a.csv": "~nosuchuser|home",
    f"run ideal --model reference --out {'a' * 240}.csv": "aaa.csv|200 bytes",
    "run ideal --model reference --out /proc/self/a.csv": "/proc/self",
    f"{RUN} --accuracy fine": "'fine'|draft, standard, strict|positive",
    f"{RUN} --formulation nope": "solver.reference.formulation = 'nope'|minimal",
    f"{RUN} --set solver.reference.method=nope": "method = 'nope'|dop853|LSODA",
    "validate nowhere.toml": "'nowhere.toml'",
    "validate ideal --models reference,reference": "reference|two",
    "compare x.csv": "'B'",
    f"{COMPARE} --tolerance -1": "tolerance = -1.0 must be > 0",
    f"{COMPARE} --share 1.5": "share = 1.5 must be <= 1",
    f"{COMPARE} --at-events before": "at_events = 'before' must be 'left', 'right' or 'both'",
    f"{COMPARE} --refinement-a 2": "--refinement-a '2'|2,4",
    f"{COMPARE} --coarser-a y.csv": "x|finer",
    f"{COMPARE} --scene ideal --tolerance 0.1": "x: |slider_y",
    f"plot x.csv --channels {','.join(['slider_x'] * 31)}": "--channels|31|30",
    "plot x.csv --out a.bmp": "a.bmp|.svg, .png or .pdf",
    "plot x.csv --from 2 --to 1": "--from 2|before --to 1",
    "plot x.csv --from 2": "x: |two samples",
    "plot x.csv y.csv x.csv": "3 tables",
    "plot x.csv x.csv": "x.csv|twice",
    "animate x.csv": "x: |--scene",
    "animate x.csv --scene ideal": "x: |'slider_y'",
    "animate x.csv --out a.avi": "a.avi|.html",
    "gate --baseline nowhere.toml": "nowhere.toml: |--update",
    "gate --baseline x.csv": "x.csv: |TOML",
    "settings ideal --seconds 0": "--seconds 0|positive",
    "study nope": "'nope'|sixbar study --help",
    "study verdicts --jobs 0": "--jobs",
    "study sweep ideal --grid drive.speed_rpm": "--grid 'drive.speed_rpm'|key=a,b,c",
    "study sweep ideal --list x.csv": "'time'",
    "study sweep ideal": "give one of --grid, --list and --latin",
    "study sweep ideal --grid drive.speed_rpm=": "needs at least one value",
    "study sweep ideal --grid drive.cycles=1 --set drive.cycles=3": "is swept",
    "study sweep ideal --grid drive.cycles=1 --set drive.cycles=2": "is swept",
    "study sweep ideal --grid contact.poisson.guid=1": "did you mean contact.poisson.guide?",
    f"{GRID} --grid drive.speed_rpm=2": "key 'drive.speed_rpm' is given twice",
    f"{GRID} --list x.csv": "--grid and --list: give one of",
    f"study sweep ideal --grid drive.cycles={MANY} --grid contact.poisson={MANY}": "1002001 points; at most",
    "study sweep ideal --list short.csv": "line 2 has 1 values for 2 keys",
    "study sweep ideal --list head.csv": "at least one line of values",
    "study sweep ideal --list twice.csv": "names a key twice",
    f"{LATIN}=2:1": "'drive.cycles=2:1'|low < high",
    f"{LATIN}=1:2 --points 0": "--points 0|1 to",
    f"{GRID} --latin drive.cycles=1:2": "--grid|--latin",
    f"{GRID} --output nope": "--output 'nope'|peak_error:slider_y",
    f"{GRID} --output max:slider_w": "--output 'max:slider_w'|did you mean",
    f"{GRID} --output peak_eror:slider_y": "did you mean 'peak_error:sl",
    f"{GRID} --scheduler nowhere": "--scheduler nowhere|tcp://host:port",
    "run ideal --model reference --out file/a.csv": "file: |not a folder",
    "run ideal --model reference --out folder.csv": "folder.csv: |not a file",
    "gate ideal --update --baseline /dev/null": "/dev/null: |not a file",
    "compare nowhere.csv y.csv": "nowhere.csv: |No such file",
    f"{FLORES} --set contact.law=adams-impact": "contact.damping_model = 'flores' needs contact.law = 'hertz",
    f"{FLORES} --set contact.restitution=0": "contact.restitution = 0.0 must be >= 0.01, by which",
    "validate one.toml other/one.toml": "'one'|two scenes",
    "run four-bar --model reference --check --out x.csv": "scene 'four-bar'|is for the press alone",
    "validate four-bar --accuracy 1e-8": "scene 'four-bar'|is for the press alone",
    "settings four-bar": "scene 'four-bar'|is for the press alone",
}


@pytest.fixture
def folder(sixbar):
    for name in ("x.csv", "y.csv"):
        sixbar.table(name, time=[0, 1, 2], slider_x=[1, 2, 3])
    for name, text in LISTS.items():
        sixbar.write(f"{name}.csv", text)
    sixbar.write("file", "")
    for name in ("one.toml", "other/one.toml"):
        sixbar.write(name, '[scene]\nextends = "ideal"\nname = "one"\ntitle = "one"\n')
    (sixbar.folder / "folder.csv").mkdir()
    (sixbar.folder / "dangling.csv").symlink_to("nowhere/x.csv")
    return sixbar


@pytest.mark.parametrize("command", MISTAKES, ids=lambda command: command[:70])
def test_a_mistake_is_one_line(command, folder):
    folder.refusal(command, *MISTAKES[command].split("|"))


VALUES = {
    "drive.cycles": "--set 'drive.cycles'|key=value",
    "=3": "--set '=3'|key=value",
    "drive.speed_rpm=fast": "drive.speed_rpm = 'fast'|number",
    "drive.speed_rpm=true": "drive.speed_rpm = True must be a number",
    "a..b=1": "--set 'a..b=1'|key=value",
    "drive.speed_rpm=nan": "drive.speed_rpm = nan rpm|finite",
    "drive.speed_rpm=0": "drive.speed_rpm = 0.0 rpm|zero",
    "drive.cycles=1e12": "drive.cycles = 1000000000000|samples",
    "drive.speed=3": "drive.speed |did you mean drive.speed_rpm",
    "clearance.slider=0": "clearance.slider = 0.0 m|joints.slider = 'clearance'",
    "clearance=3": "clearance = 3|section|did you mean clearance.slider?",
    "contact.friction=0.3": "contact.friction |did you mean friction.coefficient?",
    "contact.colour=3": "contact.colour |sixbar keys lists all",
    "contact.youngs_modulus={}": "contact.youngs_modulus.slider is missing",
    "load.table=[[0, 0], [0, 5]]": "load.table|rising depths",
    "load.table=[[1e-3, 5]]": "load.table|begin with [0, 0]",
    "friction.transition_speed=1e-5": "friction.transition_speed = 1e-05 m/s|friction.static_speed",
    "mechanism.rocker_branch=0": "mechanism.rocker_branch = 0|-1 or 1",
    "mechanism.slider_branch=true": "must be -1 or 1",  # it is equal to 1, but not meant as such
    "mechanism.rocker_pivot=[1]": "mechanism.rocker_pivot = [1]|2 values",
    "mechanism.rocker_pivot=['x', 1.0]": "mechanism.rocker_pivot.0 = 'x' must be a number",
    'output.groups=["corner"]': "'corner'|'accelerations', 'corners', 'joints' or 'energy'",
    'output.groups=["corners", "corners"]': "must not contain a group twice",
    "output.samples_per_cycle=10.5": "output.samples_per_cycle = 10.5|integer",
    "solver.adams.step=1": "solver.adams|installed",
    "reliability.velocity.lower=0.5": "reliability.velocity.lower = 0.5 m/s must be < upper = 0.02",
    "mechanism.crank.length=9": "mechanism|assembled",
}


@pytest.mark.parametrize("change", VALUES)
def test_a_bad_value_is_named_with_its_rule(change, sixbar):
    place = [] if VALUES[change].startswith("--set") else ["scene '150rpm-0.2mm"]
    sixbar.refusal(["plan", "150rpm-0.2mm", "--set", change], *place, *VALUES[change].split("|"))


PAPER = '[scene]\nextends = "paper"\n'
FILES = {
    '[scene]\nextends = "bad.toml"\n': "scene.extends|circular",
    "[drive]\nspeed_rpm = 1\n": "mechanism|missing|scene.extends",
    "[scene\n": "TOML|line 1",
    PAPER + 'name = "a/b"\n': "scene.name = 'a/b'",
    PAPER + f"x = {'[' * 2000}{']' * 2000}\n": "nested",
    PAPER + '["a b"]\nc = 1\n': "'a b' is not a known key",
    PAPER + f"[drive]\ncycles = {'9' * 5000}\n": "cannot be read as TOML: Exceeds the limit",
    PAPER + "[drive]\ncycles = 1e308\n": "must give 1 to 100000000 samples, not inf",
    PAPER + "[drive]\nspeed_rpm = 1e-310\n": "last for ever",
    PAPER + f'name = "{"a" * 240}"\n': "must have at most 100 characters",
    PAPER.replace("paper", "a" * 5000): "File name too long",
    PAPER.replace('"paper"', "3"): "scene.extends = 3 must be a shipped name or a path",
    PAPER + '[drive]\n"\\u001b[2J" = 1\n': r"\x1b",
    b'[scene]\ntitle = "\xff"\n': "utf-8",
    b"#" * 20_000_000: "larger than",
}


@pytest.mark.parametrize("text", FILES, ids=lambda text: repr(text[:50]))
def test_a_bad_scene_file_is_one_line_that_cannot_colour_a_terminal(text, sixbar):
    err = sixbar.refusal(f"plan {sixbar.write('bad.toml', text)}", *FILES[text].split("|"))
    assert "\x1b" not in err


def test_names_that_are_no_text_or_would_colour_a_terminal(sixbar):
    sixbar.refusal(["plan", "\udcff.toml"], r"\udcff.toml", "UTF-8")
    for command in (["plan", "\x1b]0;title\x07"], ["\x1b[31m"], ["plan", "ideal", "--\x1b[31m"]):
        assert "\x1b" not in sixbar.refusal(command, r"\x1b")


def test_a_scene_may_begin_with_a_byte_order_mark(sixbar):
    """Editors of Windows write it."""
    text = '[scene]\nextends = "ideal"\n'
    sixbar.write("plain.toml", text)
    sixbar.write("marked.toml", text.encode("utf-8-sig"))
    plan, marked_plan = (sixbar("plan", f"{name}.toml").out for name in ("plain", "marked"))
    assert plan.replace("plain", "marked") == marked_plan
