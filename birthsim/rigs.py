"""What ``birthsim drive`` does: limits are shown, a rig is driven, its log and timing are written."""

from pathlib import Path
from typing import TYPE_CHECKING

from tqdm import tqdm

from baselines.identification.log.log_file import write_trial
from baselines.named import make_controller
from birthsim.command_line.worlds import check_environment
from birthsim_drive.loop.asked import asked_table
from birthsim_drive.provoked import provoked
from birthsim_drive.safety.limits import read_limits
from birthsim_drive.session import Drive, Outcome, forget, limited_name, perform, recovered
from birthsim_drive.simulated import Simulated
from birthsim_env.files import own_folder, whole_results, write_json, write_text
from birthsim_env.ids import rig_for
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

if TYPE_CHECKING:
    from birthsim.commands.drive import Settings

SIMULATED = "simulated"
RESTS = 10.0
"""s for which a rig rests where nothing says for how long."""

RESTING = {False: "BirthSIM/Probe-v3", True: "BirthSIM/Rail-v0"}
"""The scenario that a simulated rig has where none is asked for, by whether it is a rail."""

FAULTY = 1
"""Exit status of a drive that a fault has ended."""

ONLY_SIMULATED = ("rig", "lockstep", "provoke")


def drive(settings: "Settings") -> None:
    """Drive a rig, print what happened and write what is left."""
    told = _drive_of(settings)
    if settings.show_limits:
        print("\n".join(told.limits.words()))
        return
    if settings.out is None:
        raise ValueError("--out is missing; allowed: a folder for the log")
    with own_folder(settings.out) as folder:
        _recover(folder, told.rig)
        seconds = told.duration if told.plan is None and told.environment is None else None
        with tqdm(total=seconds, desc="drive", unit=" s", leave=False, bar_format="{desc}: {n:.1f} s [{elapsed}]") as bar:
            outcome = perform(told, folder, lambda now: bar.update(now - bar.n))
        _write(outcome, told, folder, settings.style)
    if outcome.interrupted is not None:
        raise outcome.interrupted
    if outcome.faults and not told.dry:
        raise SystemExit(FAULTY)


def _drive_of(settings: "Settings") -> Drive:
    """What the settings ask for; ``ValueError`` for what does not fit together."""
    if settings.plan is not None and settings.env is not None:
        raise ValueError("--plan with --env; allowed: one of them")
    if settings.plan is not None and settings.duration is not None:
        raise ValueError("--duration with --plan; allowed: without it, a plan has its own")
    simulated = settings.driver == SIMULATED
    for name in ONLY_SIMULATED:
        if getattr(settings, name) and not simulated:
            raise ValueError(f"--{name} with --driver {settings.driver}; allowed: with --driver {SIMULATED}")
    rig = load_parameters(settings.parameters) if settings.env is None else rig_for(settings.env, settings.parameters)
    for one in settings.provoke:
        provoked(one)
    if settings.env is not None:
        check_environment(settings.env)
    make_controller(settings.controller, rig)
    rests = settings.plan is None and settings.env is None
    return Drive(
        driver=settings.driver,
        controller=settings.controller,
        rig=rig,
        limits=read_limits(settings.safety, rig),
        plan=settings.plan,
        environment=settings.env,
        seed=settings.seed,
        duration=RESTS if rests and settings.duration is None else settings.duration,
        ramp=settings.ramp,
        limiter=not settings.no_limiter,
        dry=settings.dry_run,
        priority=settings.priority,
        simulated=_simulated(settings, rig) if simulated else None,
    )


def _simulated(settings: "Settings", rig: Parameters) -> Simulated:
    environment = settings.env or RESTING[rig.linkage.is_rail]
    true = rig if settings.rig is None else load_parameters(settings.rig)
    return Simulated(environment, true, settings.sensors, settings.seed, settings.lockstep, tuple(settings.provoke))


def _recover(folder: Path, rig: Parameters) -> None:
    """Write what a drive left whose watching process was killed."""
    left = recovered(folder, rig)
    if left is not None and left.sampled.size:
        write_trial(left.trial(rig), folder / "log_recovered.csv", rig)
        print(f"a former drive was killed; what it had logged: {folder / 'log_recovered.csv'}")
    forget(folder)


def _write(outcome: Outcome, told: Drive, folder: Path, style: str) -> None:
    timing, files = outcome.timing, ["timing.json"]
    by_clock = told.simulated is None or not told.simulated.lockstep
    with whole_results(folder) as place:
        if outcome.sampled.size:
            write_trial(outcome.trial(told.rig), place / "log.csv", told.rig)
            write_text(place / "asked.csv", asked_table(outcome.sampled, told.rig))
            files = ["log.csv", "asked.csv", *files]
        write_json(place / "timing.json", {**timing.summary(), "system": outcome.granted})
        if outcome.sampled.size and by_clock:
            # pyplot takes half a second to load.
            from baselines.figures.style import drawn_for
            from baselines.figures.timing import timing_figure

            times = {"period": timing.periods, "jitter": timing.jitter, "computing": timing.computing}
            with drawn_for(style):
                files += [path.name for path in timing_figure(times, timing.period, place)]
    print(f"{limited_name(told)}, {outcome.sampled.shape[1]} samples; {outcome.granted}")
    print("\n".join(timing.words()) if by_clock else "in lockstep: no clock runs, so that nothing is late")
    for fault in outcome.faults:
        print(fault.words())
    if not outcome.faults:
        print("no fault")
    if outcome.fate is not None:
        fate = outcome.fate
        ended = f"{fate.ended} after {fate.periods} periods ({fate.stalls} stalls of its own)"
        pressures = f"{fate.pressures[0] / 1e5:.2f} to {fate.pressures[1] / 1e5:.2f} bar"
        print(f"simulated rig: {ended}, valves {fate.openings}")
        print(f"its fastest {fate.speed:.2g} m/s, its hardest stop {fate.impact:.2g} m/s, {pressures}")
    print(f"written to {folder}/: {', '.join(files)}")
