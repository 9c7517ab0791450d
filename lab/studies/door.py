"""``birthsim study NAME``: what the project measures of itself and of its controllers; it comes with a clone."""

import sys
from importlib import import_module
from typing import NamedTuple

from birthsim.command_line.start import perform
from birthsim_env.physics.rig.values import near, shown


class Entry(NamedTuple):
    """Where a study is: a module below ``studies``, and in it the name of its declaration, or "" for a command of its own."""

    module: str
    declaration: str
    measures: str


STUDIES = {
    "acceleration": Entry("comparison.study", "ACCELERATION", "what an acceleration sensor adds"),
    "acceleration-feel": Entry("haptics.study", "ACCELERATION", "a pull let go with an acceleration sensor"),
    "accuracy": Entry("accuracy.study", "STUDY", "the error of the plant's integrator, against a second model"),
    "air": Entry("least_air.study", "STUDY", "how much air the schedule of least air saves"),
    "bandwidth": Entry("bandwidth.study", "STUDY", "up to which frequency a hand feels what is declared"),
    "beside-law": Entry("residual.beside_law", "STUDY", "policies of several seeds beside their controller"),
    "bound": Entry("comparison.study", "BOUNDED", "how far controllers are from a planner that looks ahead"),
    "by-gradients": Entry("learned.study", "BY_GRADIENTS", "policies by gradients beside classical controllers"),
    "circle": Entry("comparison.study", "CIRCLES", "controllers and policies on circles that guided no decision"),
    "comparison": Entry("comparison.study", "COMPARISON", "every controller under all conditions"),
    "figure4": Entry("figure4", "STUDY", "errors in the experiment of the paper's Fig. 4"),
    "floor": Entry("honest.floor", "STUDY", "what errors of honest sensors leave to controllers"),
    "gradients": Entry("gradients.study", "STUDY", "what gradients cost, and how far they can be trusted"),
    "gradients-checks": Entry("gradients.checks", "STUDY", "gradients through closed loops beside differences"),
    "haptics": Entry("haptics.study", "STUDY", "what a hand feels"),
    "honest": Entry("comparison.study", "HONEST", "what honest sensors cost"),
    "identified": Entry("sensorless.identified", "STUDY", "what a hand feels once a rig is identified from its own log"),
    "installed": Entry("installed", "STUDY", "README's commands, from the wheel alone in an empty home"),
    "leaderboard": Entry("leaderboard", "", "whether entries of leaderboard/ repeat, bit for bit"),
    "learned": Entry("learned.study", "STUDY", "what shipped policies take off controllers' errors"),
    "limited": Entry("comparison.study", "LIMITED", "what a limiter costs"),
    "limits": Entry("haptics.study", "LIMITS", "what a hand feels of a controller in a limiter"),
    "own-motion": Entry("residual.own_motion", "STUDY", "policies beside the impedance they are to render"),
    "pools": Entry("pools", "STUDY", "what other processes and hosts cost"),
    "recovery": Entry("recovery.study", "STUDY", "how well identification finds rigs that are known"),
    "recovery-rest": Entry("recovery.study", "AT_REST", "what a log of a rig at rest tells of it"),
    "responses": Entry("responses.study", "STUDY", "frequency responses of the rig, and their resonances"),
    "scores": Entry("scores.study", "STUDY", "what every environment pays to whom"),
    "sensorless": Entry("sensorless.study", "STUDY", "what a hand feels without a force sensor"),
    "soak": Entry("soak.command", "", "10^8 policy steps over all that there is"),
    "speed": Entry("speed.study", "STUDY", "speeds, beside what they are to be compared with"),
    "stability": Entry("stability.study", "STUDY", "maps of where a controller is stable"),
    "stiffest": Entry("stability.stiffest", "STUDY", "stiffest setpoints at which the paper's law rests"),
    "stiffness": Entry("comparison.feel", "STUDY", "how the stiffness of every controller feels"),
    "strangers": Entry("strangers.study", "STUDY", "identification and controllers on rigs that the model lacks"),
    "sweep": Entry("sweeps.study", "STUDY", "grids, random draws and searches, from a TOML file"),
    "targets": Entry("targets.study", "STUDY", "built code of every target, against Python"),
    "wide-rigs": Entry("honest.wide_rigs", "STUDY", "controllers on rigs of 1 to 10 kg that they do not know"),
    "worst": Entry("honest.worst", "STUDY", "the worst worlds, and what each owes to its figures"),
}

OWN = {
    "status": "list which results/*.json are fresh, and what has changed",
    "render": "write tables of docs, README, scores from results/",
    "draw": "draw the pictures of docs from results/*.json",
    "renew": "run every study whose result is stale",
}


def overview() -> str:
    """The help: one line a study."""
    width = max(map(len, STUDIES))
    lines = [f"  {name:{width}}  {study.measures}" for name, study in STUDIES.items()]
    own = [f"  {name:{width}}  {does}" for name, does in OWN.items()]
    return "\n".join(["usage: birthsim study NAME ...", "", *lines, "", *own, "", "example: birthsim study speed"])


def main(arguments: list[str]) -> None:
    """Run the study that the first argument names; the others are its own."""
    if not arguments or arguments[0] in ("-h", "--help"):
        print(overview())
        raise SystemExit(0 if arguments else 2)
    name, *rest = arguments
    if name not in {**STUDIES, **OWN}:
        allowed = ", ".join([*OWN, *STUDIES])
        print(f"birthsim study: error: NAME = {shown(name)}{near(name, STUDIES)}; allowed: {allowed}", file=sys.stderr)
        raise SystemExit(2)
    sys.argv = ["", *rest]
    declared = name in OWN or STUDIES[name].declaration
    perform(f"birthsim study {name}", import_module(f"lab.studies.{'shelf' if declared else STUDIES[name].module}"))
