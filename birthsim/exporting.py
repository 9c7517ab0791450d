"""``birthsim.export``: what ``birthsim export`` writes, from Python."""

from pathlib import Path
from typing import Any, get_type_hints

from birthsim_env.physics.rig.values import near, path_of, shown
from birthsim_env.registry import entry


def export(form: str, /, **options: Any) -> Path | None:
    """Write a policy, closed loops, the rig or a log in a form that others read.

    Parameters
    ----------
    form : str
        What to write, such as ``"onnx"``, ``"wasm"``, ``"c"``, ``"fmu"`` or ``"parquet"``; ``birthsim export --help`` lists
        all of them.
    **options
        Those of ``birthsim export --to FORM --help``, with underscores for dashes: ``out``, where to write, ``policy``,
        ``controller``, ``env`` and so on. Where an option takes several values, a list.

    Returns
    -------
    Path or None
        ``out``; None where it was left to the form. What was written is printed too, as the command does.

    Raises
    ------
    ValueError
        Names a form or an option that there is not, or the option, its value and what is allowed.

    Examples
    --------
    >>> import birthsim, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = birthsim.export("fmu", out=pathlib.Path(folder) / "rig.fmu")
    ...     path.name
    written to ...rig.fmu: ...
    'rig.fmu'
    """
    chosen = entry("export", form).made
    known = [name for name in vars(chosen.settings)["__dataclass_fields__"] if name not in ("to", "config")]
    for name, value in options.items():
        if name not in known:
            raise ValueError(f"{name} = {shown(value)}{near(name, known)}; allowed for {form}: {', '.join(known)}")
    for name, kind in get_type_hints(chosen.settings).items():
        if kind in (Path, Path | None) and name in options and options[name] is not None:
            if path_of(options[name]) is None:
                raise ValueError(f"{name} = {shown(options[name])}; allowed: a path")
            options[name] = Path(options[name])
    try:
        settings = chosen.settings(to=form, **options)
    except TypeError as error:
        raise ValueError(f"export({form!r}): {error}; allowed: {', '.join(known)}") from None
    chosen.write(settings)
    return options.get("out")
