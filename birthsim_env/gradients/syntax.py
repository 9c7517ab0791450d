"""Rewrites the syntax tree of a helper, so that what asks for a truth value calls ``tracing`` instead."""

import ast
from typing import Any


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(f"__{name}", ast.Load()), list(arguments), [])


def _later(expression: ast.expr) -> ast.Lambda:
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), expression)


class Rewriter(ast.NodeTransformer):
    """Rewrites what asks for a truth value."""

    def visit_IfExp(self, n: ast.IfExp) -> Any:
        return _call("select", self.visit(n.test), *(_later(self.visit(way)) for way in (n.body, n.orelse)))

    def visit_BoolOp(self, n: ast.BoolOp) -> Any:
        name = ast.Constant("and" if isinstance(n.op, ast.And) else "or")
        return _call("logic", name, *(_later(self.visit(value)) for value in n.values))

    def visit_UnaryOp(self, n: ast.UnaryOp) -> Any:
        self.generic_visit(n)
        return _call("denied", n.operand) if isinstance(n.op, ast.Not) else n

    def visit_Compare(self, n: ast.Compare) -> Any:
        self.generic_visit(n)
        if len(n.ops) == 1:
            return n
        sides = [n.left, *n.comparators]
        pairs = [_later(ast.Compare(a, [op], [b])) for a, op, b in zip(sides, n.ops, sides[1:], strict=False)]
        return _call("logic", ast.Constant("and"), *pairs)

    def visit_Call(self, n: ast.Call) -> Any:
        self.generic_visit(n)
        return ast.Call(ast.Name("__call", ast.Load()), [n.func, *n.args], n.keywords)

    def block(self, statements: list[ast.stmt]) -> list[ast.stmt]:
        """Statements with their loops and ``if`` rewritten."""
        done: list[ast.stmt] = []
        for k, statement in enumerate(statements):
            if isinstance(statement, ast.If):
                made, ends = self._if(statement, statements[k + 1 :])
                done += made
                if ends:
                    return done
            elif isinstance(statement, ast.For):
                done += self._for(statement, k)
            else:
                done.append(self.visit(statement))
        return done

    def _for(self, loop: ast.For, k: int) -> list[ast.stmt]:
        """A loop; over ``range(count)`` each pass happens only where the count asks for it."""
        called = loop.iter if isinstance(loop.iter, ast.Call) and ast.unparse(loop.iter.func) == "range" else None
        if called is None or len(called.args) != 1 or not isinstance(loop.target, ast.Name):
            return [ast.For(loop.target, self.visit(loop.iter), self.block(loop.body), [])]
        count, target = f"__n{k}_{loop.lineno}", loop.target.id
        target = f"__k{loop.lineno}" if target == "_" else target
        test = ast.Compare(ast.Name(target, ast.Load()), [ast.Lt()], [ast.Name(count, ast.Load())])
        leaves = any(isinstance(x, (ast.Break, ast.Continue, ast.Return)) for x in ast.walk(loop))
        number, body = self.visit(called.args[0]), self.block(loop.body if leaves else [ast.If(test, loop.body, [])])
        return [
            ast.Assign([ast.Name(count, ast.Store())], _call("known", number) if leaves else number),
            ast.For(ast.Name(target, ast.Store()), _call("passes", ast.Name(count, ast.Load())), body, []),
        ]

    def _if(self, statement: ast.If, rest: list[ast.stmt]) -> tuple[list[ast.stmt], bool]:
        """An ``if`` as two local functions; one that returns takes the statements after it into both of them."""
        if any(isinstance(x, (ast.Break, ast.Continue)) for x in ast.walk(statement)):
            test = _call("known", self.visit(statement.test))
            return [ast.If(test, self.block(statement.body), self.block(statement.orelse))], False
        leaves = any(isinstance(x, ast.Return) for x in ast.walk(statement))
        ways = [[*body, *(rest if leaves else [])] for body in (statement.body, statement.orelse)]
        changed = sorted(
            {x.id for way in ways for s in way for x in ast.walk(s) if isinstance(x, ast.Name) and isinstance(x.ctx, ast.Store)}
        )
        done: list[ast.stmt] = []
        for name, way in zip(("__yes", "__no"), ways, strict=True):
            head = f"def {name}({', '.join(f'{one}=__local(locals(), {one!r})' for one in changed)}): pass"
            function = ast.parse(head).body[0]
            assert isinstance(function, ast.FunctionDef)
            give = ast.Return(ast.Tuple([ast.Name(one, ast.Load()) for one in changed], ast.Load()))
            function.body = [*self.block([_copied(s) for s in way]), *([] if leaves else [give])]
            function.body = function.body or [ast.Pass()]
            done.append(function)
        merged = _call("branch", self.visit(statement.test), *(ast.Name(name, ast.Load()) for name in ("__yes", "__no")))
        if leaves:
            return [*done, ast.Return(merged)], True
        target = ast.Tuple([ast.Name(one, ast.Store()) for one in changed], ast.Store())
        return [*done, ast.Assign([target], merged) if changed else ast.Expr(merged)], False


class Continues(ast.NodeTransformer):
    """Makes an ``if`` that ends in ``continue`` one with an ``else``: the rest of its loop's body."""

    def visit_For(self, loop: ast.For) -> ast.For:
        self.generic_visit(loop)
        loop.body = self._with_else(loop.body)
        return loop

    def _with_else(self, body: list[ast.stmt]) -> list[ast.stmt]:
        for k, one in enumerate(body):
            if isinstance(one, ast.If) and isinstance(one.body[-1], ast.Continue):
                one.body = one.body[:-1] or [ast.Pass()]
                one.orelse += self._with_else(body[k + 1 :])
                return body[: k + 1]
        return body


def _copied(statement: ast.stmt) -> ast.stmt:
    return ast.parse(ast.unparse(ast.fix_missing_locations(statement))).body[0]
