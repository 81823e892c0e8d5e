"""Batch scripts of a campaign: pure functions of its path, the settings of a cluster and a template."""

import math
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

from nanoslip.solver.outcome import NanoslipError
from nanoslip.study import shipped
from nanoslip.study.exit_codes import INTERRUPTED
from nanoslip.study.manifest.checker import read_text
from nanoslip.study.manifest.problems import ManifestError, Place, Problem, path_shown
from nanoslip.study.run.launch import WARNING
from nanoslip.study.toml_text import ONE_LINE, from_toml, is_one_line, quote_toml

TEMPLATE = "job.sh.j2"
PLANNED: Final = "plan"
"""Memory of a job that is taken from its plan."""
_MEMORY: Final = re.compile(r"(\d{1,9}[KMGT]?)?|plan")
ROUNDED: Final = 100
"""Megabytes of which a request is a multiple: estimates are no finer."""


class SiteError(NanoslipError):
    """A file of site settings is wrong; one line per problem: file: key = value: requirement."""


@dataclass(frozen=True, slots=True)
class Site:
    """Settings that submit jobs at one site: all that differs between clusters, and nothing of any campaign."""

    template: str = TEMPLATE
    """Name of the template's file beside the settings; if the file is missing, nanoslip's template is used."""
    tasks: int = 4
    """Ranks; one core each."""
    nodes: int = 1
    time: str = "01:00:00"
    """Time limit of a job; an unfinished campaign is requeued and goes on."""
    partition: str = ""
    account: str = ""
    mpi: str = "pmi2"
    """Value of `srun --mpi`: pmi2 for MPICH and its kin, pmix for Open MPI."""
    warning: int = WARNING
    """Seconds before the limit at which the ranks are signalled to stop; tasks that take longer are started again."""
    restarts: int = 50
    """Times a job is put back into the queue before it gives up."""
    deaths: int = 5
    """Likewise where one of its ranks was killed."""
    memory: str = PLANNED
    """Memory of each rank, as sbatch reads it; `plan` for the memory of the largest task, empty for no request."""
    command: str = "nanoslip"
    """Command that the ranks execute."""
    options: tuple[str, ...] = ()
    """Further options of sbatch, each a line of the script."""
    setup: tuple[str, ...] = ()
    """Lines of shell before the start: modules, environments."""

    def __post_init__(self) -> None:
        needs = {}
        for setting in fields(self):
            value = getattr(self, setting.name)
            kind = type(setting.default)
            needs[setting.name] = _need(setting.name, value, kind)
        if not needs["time"] + needs["warning"] and self.warning >= parse_time_limit(self.time):
            needs["warning"] = f"less than time = {quote_toml(self.time)}"
        wrong = {name: need for name, need in needs.items() if need}
        problems = [Problem(Place(), name, getattr(self, name), need) for name, need in wrong.items()]
        if problems:
            raise ManifestError(problems)


def _need(name: str, value: Any, kind: type) -> str:
    """Need of a wrong setting; empty for a valid value."""
    is_list = isinstance(value, tuple)
    items = value if is_list else (value,)
    item_kind = str if is_list else kind
    is_of_kind = isinstance(value, kind) and not isinstance(value, bool)
    if not is_of_kind or not all(isinstance(item, item_kind) for item in items):
        return _KINDS[kind]
    least = 0 if name in ("restarts", "deaths") else 1
    if kind is int:
        return f"at least {least}" if value < least else ""
    if not all(map(is_one_line, items)):
        return ONE_LINE
    has_form, need = _FORMS.get(name, (lambda _: True, ""))
    return "" if has_form(value) else need


def parse_time_limit(time: str) -> float:
    """Seconds of a time limit as sbatch reads it; NaN of another text."""
    days, dash, rest = time.rpartition("-")
    parts = rest.split(":")
    if len(parts) > 3:
        return math.nan
    texts = [*parts, days] if dash else parts
    if not all(text.isascii() and text.isdigit() for text in texts):
        return math.nan
    numbers = [int(part) for part in parts]
    # After days the first number is hours; alone it is minutes, as before one of seconds.
    has_hours = bool(dash) or len(numbers) == 3
    # What is not given is 0: hours before minutes, seconds after them.
    given = [*numbers, 0, 0] if has_hours else [0, *numbers, 0]
    hours, minutes, seconds = given[:3]
    return 86400.0 * int(days or 0) + 3600.0 * hours + 60.0 * minutes + seconds


_KINDS: Final[dict[type, str]] = {str: "a text", int: "a whole number", tuple: "a list of texts"}
_TIMES: Final = "a time as minutes, mm:ss, hh:mm:ss, d-hh, d-hh:mm or d-hh:mm:ss"
_MPI: Final = ("pmi2", "pmix", "cray_shasta", "none")
_FORMS: Final[dict[str, tuple[Callable[[str], bool], str]]] = {
    "template": (lambda text: Path(text).name == text, "the name of a file beside the settings"),
    "mpi": (
        lambda text: text.startswith(_MPI),
        f"{', '.join(_MPI)}, or a version of one, as `srun --mpi=list` names them",
    ),
    "memory": (
        lambda text: _MEMORY.fullmatch(text) is not None,
        'a size as "4G", "plan" for what the plan expects, or "" for no request',
    ),
    "time": (lambda text: not math.isnan(parse_time_limit(text)), _TIMES),
}
"""Setting -> predicate of a valid text, and the requirement."""


def load_site(path: Path) -> tuple[Site, str]:
    """Site settings and the text of their template. Raises SiteError, with all problems."""
    names = [item.name for item in fields(Site)]
    problems = list[Problem]()
    try:
        content = from_toml(read_text(path))
        remark = f"unknown; needs one of {', '.join(names)}"
        problems += [Problem(Place(), key, remark=remark) for key in content if key not in names]
        values: dict[str, Any] = {key: setting for key, setting in content.items() if key in names}
        for key, value in values.items():
            if isinstance(value, list):
                values[key] = tuple(value)
        site = Site(**values)
        if not problems:
            return site, read_text(_template(path, site.template))
    except ManifestError as error:
        problems += error.problems
    except ValueError as error:
        raise SiteError(f"{path}: {error}") from None
    place = Place(path_shown(path))
    placed = (problem if problem.place.file else replace(problem, place=place) for problem in problems)
    raise SiteError("\n".join(map(str, placed)))


def _template(settings: Path, name: str) -> Path:
    """The file of a template; all of its text stands in the script."""
    beside = settings.parent / name
    return beside if name != TEMPLATE or beside.exists() else shipped.folder("slurm") / name


@dataclass(frozen=True, slots=True)
class Job:
    """A campaign for the batch system: its file and results folder. Raises SiteError."""

    campaign: Path
    out: Path
    memory: float = 0.0
    """Bytes that a rank needs for its largest task; 0 if unknown."""

    def __post_init__(self) -> None:
        for path in (self.campaign, self.out):
            # Each path is part of lines that sbatch and the shell read.
            if not is_one_line(str(path)):
                raise SiteError(f"{path_shown(path)}: needs {ONE_LINE}")
            if "\\" in str(path):
                raise SiteError(f"{path_shown(path)}: needs to be without backslashes, which sbatch takes out of names")

    def shell_command(self, command: str) -> str:
        """A command of nanoslip for it, as the shell reads it."""
        return f"{command} {shlex.quote(str(self.campaign))} --out {shlex.quote(str(self.out))}"


def script(job: Job, site: Site, template: str) -> str:
    """The batch script that runs a campaign as one MPI job and puts itself back into the queue until it is finished.

    A template can do nothing but lay out text. Raises SiteError if it tries, or is wrong.
    """
    return _script(job, site, template, run=job.shell_command("run"))


def array_script(job: Job, shards: int, site: Site, template: str) -> str:
    """The script of an array of jobs, each of which computes a shard and puts itself back into the queue. Raises SiteError."""
    site = replace(site, options=(*site.options, f"--array=1-{shards}"))
    run = f'{job.shell_command("run")} --shard "$SLURM_ARRAY_TASK_ID/{shards}"'
    return _script(job, site, template, run, "%A_%a", '"${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"')


def merge_script(job: Job, site: Site, template: str) -> str:
    """Script of the job after an array that merges the finished results of the shards. Raises SiteError."""
    alone = replace(site, nodes=1, tasks=1, restarts=0, deaths=0)
    return _script(job, alone, template, job.shell_command("merge"))


def _memory_request(job: Job, site: Site) -> str:
    """Memory of each core, as sbatch reads it; empty for none, as where an option of the site has it."""
    if any(option.startswith("--mem") for option in site.options):
        return ""
    if site.memory != PLANNED:
        return site.memory
    return f"{ROUNDED * math.ceil(job.memory / 1e6 / ROUNDED)}M" if job.memory else ""


def _script(job: Job, site: Site, template: str, run: str, number: str = "%j", shell: str = '"$SLURM_JOB_ID"') -> str:
    """number: of the job, in the name of its log. shell: the same to the shell."""
    # Imported here: plans and runs read settings and make no script.
    import jinja2  # noqa: PLC0415
    from jinja2.sandbox import SandboxedEnvironment  # noqa: PLC0415

    # In a sandbox, as a template may come from another user; strictly, as an empty word in a script
    # of shell may mean anything.
    environment = SandboxedEnvironment(undefined=jinja2.StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
    settings: dict[str, Any] = {item.name: getattr(site, item.name) for item in fields(site)}
    settings_of_job = {
        "name": shlex.quote(job.campaign.stem),
        "run": f"{site.command} {run}",
        # In the name of a file sbatch reads % as the start of a pattern, %% as the sign itself.
        "log": shlex.quote(str(job.out).replace("%", "%%") + f"/slurm-{number}.log"),
        "this_job": shell,
        "again": INTERRUPTED,
        "memory": _memory_request(job, site),
    }
    try:
        return environment.from_string(template).render(settings, **settings_of_job)
    except (jinja2.TemplateError, ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise SiteError(f"{site.template}: {error}") from None
