"""A small project in which every way from a study to what it calls occurs once."""

TREE = {
    "lab/studies/one.py": """
        from functools import partial
        import baselines.patches
        from baselines import tools
        from baselines.middle import through
        from baselines.named import make_controller

        def measure(controller):
            return through(make_controller(controller)), tools.scaled(2.0)

        def show(content):
            return {"one.md": f"{content}"}
        """,
    "baselines/middle.py": """
        from birthsim_env import plant
        from birthsim_env.rig import Rig

        def through(controller):
            from birthsim_env.late import finish

            return finish(plant.advance(controller, Rig(), LIMIT)), exec(SOURCE), NAMED

        def unused():
            return through(None)

        LIMIT = 3
        LIMIT += 1
        SOURCE = "from birthsim_env.generated import inner, outer as o\\nprint(inner(o()))"
        NAMED = "birthsim_env.generated:by_name"
        """,
    "birthsim_env/generated.py": """
        def inner(value):
            return value

        def outer():
            return 1.0

        def by_name():
            return 2.0

        def by_nobody():
            return 3.0
        """,
    "baselines/tools.py": """
        from birthsim_env import scaled as scaled
        """,
    "baselines/patches.py": """
        from birthsim_env import plant

        def patch():
            plant.TABLE["b"] = 2.0

        patch()
        """,
    "baselines/named.py": """
        from birthsim_env.registry import entry

        def make_controller(name):
            return entry("controller", name).made()
        """,
    "baselines/pid.py": """
        from birthsim_env.registry import register
        from baselines.staged import Staged

        @register(controller="pid", about="Three gains.")
        class PID(Staged):
            GAIN = 2.0

            def command(self):
                return self.GAIN * self.last

        class Other(PID):
            def command(self):
                return 0.0

        register(controller="other", about="None.", options={"gain": 1.0})(Other)

        for name in ("a", "b"):
            register(controller=name, about="One of many.")(Other)
        """,
    "baselines/staged.py": """
        class Staged:
            last = 1.0
        """,
    "birthsim_env/__init__.py": """
        from birthsim_env.ids import register_id
        from birthsim_env.scaling import scaled

        register_id("birthsim_env.env:Env")
        """,
    "birthsim_env/ids.py": """
        from gymnasium.envs import registration

        def register_id(where):
            registration.register("Circle", entry_point=where)
        """,
    "agents/__init__.py": """
        from birthsim_env.ids import register_id

        register_id("agents.residual:Residual")
        """,
    "agents/residual.py": """
        class Residual:
            pass
        """,
    "birthsim_env/scaling.py": """
        def scaled(value, by=2.0):
            return value * by
        """,
    "birthsim_env/env.py": """
        import gymnasium

        class Env:
            def step(self):
                return 1.0

        def made():
            return gymnasium.make("Circle")
        """,
    "birthsim_env/late.py": """
        def finish(value):
            return value
        """,
    "birthsim_env/plant.py": '''
        from numba import njit
        from numba.extending import overload
        from birthsim_env import logs

        @overload(len)
        def _length(rig):
            return lambda rig: 4

        TABLE = {"a": 1.0}

        def kernel(function):
            """Compile."""
            return njit(function)

        @kernel
        def advance(controller, rig, limit):
            """A step."""
            return TABLE["a"] * limit  # of the rig

        @kernel
        def drift(rig):
            return advance(None, rig, 1)
        ''',
    "birthsim_env/logs.py": """
        def log():
            return None
        """,
    "birthsim_env/rig.py": """
        from dataclasses import dataclass
        from birthsim_env.logs import log

        MASS = 3.0

        @dataclass
        class Rig:
            mass: float = MASS
            length: float = 1.0
        """,
    "birthsim_env/registry.py": """
        def register(**named):
            return lambda made: made

        def entry(kind, name):
            return None
        """,
}


def written(folder, files):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = text.splitlines()
        path.write_text("\n".join(line[8:] for line in lines) + "\n")
