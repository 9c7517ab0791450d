# mypy: disable-error-code="no-untyped-call, untyped-decorator"
"""What kernels know of ``records``: types for a layout, for the rows of an array by name, and for those of a block.

A block is known by its address alone: the view of a group is made where a kernel asks for it, with constant shape and strides,
so that LLVM vectorises loops over its lanes. A layout is described by ``groups`` (each with ``first``, ``count``, ``single``,
``layout``), ``size`` and ``per_lane``.
"""

import functools
from typing import Any

from llvmlite import ir
from numba import typeof
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.imputils import impl_ret_borrowed, lower_builtin, lower_constant, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr, make_callable_template
from numba.extending import NativeValue, register_model, typeof_impl, unbox

from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.named import Layouts

WORD, NUMBERS = ir.IntType(64), ir.DoubleType().as_pointer()


class Layout(types.Callable, types.Opaque):
    """A layout in a kernel: called with an array it gives a record."""

    def __init__(self, layout: Any) -> None:
        self.layout = layout
        super().__init__(f"Layout({layout.__module__}.{layout.__qualname__})")

    def get_call_type(self, context: Any, args: Any, kws: Any) -> None:
        """None: ``_LayoutAttributes`` says it."""

    def get_call_signatures(self) -> tuple[tuple[Any, ...], bool]:
        """None of its own, since it may be called with any array."""
        return (), True

    def get_impl_key(self, sig: Any) -> type:
        """What it is lowered by."""
        return type(self)


class Record(types.Type):
    """The rows of an ``array`` by name."""

    def __init__(self, layout: Any, array: types.Array) -> None:
        # Rows of an array in Fortran's order are not contiguous: their strides count.
        self.layout, self.array = layout, array if array.layout == "C" else array.copy(layout="A")
        super().__init__(f"{type(self).__name__}({layout.__module__}.{layout.__qualname__}, {self.array})")

    def of(self, group: Any) -> Any:
        """Type of a group: a record, an array, or a number."""
        if group.layout:
            return type(self)(group.layout, self.array)
        dimensions = self.array.ndim - group.single
        return self.array.copy(ndim=dimensions) if dimensions else self.array.dtype


class Block(Record):
    """The rows of a block (``size``, BLOCK) of lanes, or of numbers (``size``,), by name: a whole number, their address."""


def block_type(layout: Any) -> Block:
    """What a stage is handed of a layout."""
    return Block(layout, types.Array(types.float64, 1 + layout.per_lane, "C"))


register_model(Layout)(models.OpaqueModel)


@register_model(Record)
class _RecordModel(models.StructModel):
    def __init__(self, manager: Any, record: Record) -> None:
        super().__init__(manager, record, [("rows", record.array)])


@register_model(Block)
class _BlockModel(models.PrimitiveModel):
    """One pointer, from which all views begin, so that LLVM sees that they do not overlap; in a call a whole number."""

    def __init__(self, manager: Any, record: Block) -> None:
        super().__init__(manager, record, NUMBERS)

    def get_argument_type(self) -> Any:
        return WORD

    def as_argument(self, builder: Any, value: Any) -> Any:
        return builder.ptrtoint(value, WORD)

    def from_argument(self, builder: Any, value: Any) -> Any:
        return builder.inttoptr(value, NUMBERS)


@typeof_impl.register(Layouts)
def _type_of_layout(layout: Layouts, _: Any) -> Layout:
    return Layout(layout)


def type_of_record(record: Any) -> Record:
    """The type of an array's rows by name."""
    return Record(type(record), typeof(record.rows))


@lower_constant(Layout)
def _constant(context: Any, builder: Any, layout: Layout, value: Any) -> Any:
    return context.get_dummy_value()


@unbox(Record)
def _unbox(record: Record, value: Any, c: Any) -> NativeValue:
    array = c.pyapi.object_getattr_string(value, "rows")
    native = c.unbox(record.array, array)
    c.pyapi.decref(array)
    return NativeValue(_record(c.context, c.builder, record, native.value), is_error=native.is_error)


@unbox(Block)
def _unbox_address(record: Block, value: Any, c: Any) -> NativeValue:
    address = c.unbox(types.int64, value)
    return NativeValue(c.builder.inttoptr(address.value, NUMBERS), is_error=address.is_error)


@infer_getattr
class _LayoutAttributes(AttributeTemplate):
    key = Layout

    def resolve_size(self, layout: Layout) -> Any:
        return types.literal(layout.layout.size)

    def resolve___call__(self, layout: Layout) -> Any:
        def typer(array: types.Array) -> Record:
            return Record(layout.layout, array)

        return types.Function(make_callable_template(self.key, typer))


@infer_getattr
class _RecordAttributes(AttributeTemplate):
    key = Record

    def generic_resolve(self, record: Record, name: str) -> Any:  # type: ignore[override]
        group = record.layout.groups.get(name)
        return record.array if name == "rows" else group and record.of(group)


@lower_getattr_generic(Layout)
def _size(context: Any, builder: Any, layout: Layout, value: Any, name: str) -> Any:
    return WORD(layout.layout.size)


@lower_builtin(Layout, types.Array)
def _name(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return impl_ret_borrowed(
        context, builder, signature.return_type, _record(context, builder, signature.return_type, arguments[0])
    )


@lower_getattr_generic(Block)
def _of_block(context: Any, builder: Any, record: Block, value: Any, name: str) -> Any:
    """A view, a number, or where a part begins."""
    group, columns = record.layout.groups.get(name), BLOCK if record.array.ndim > 1 else 1
    first, count = (group.first, group.count) if group else (0, record.layout.size)
    data = builder.gep(value, [WORD(columns * first)])
    if group and group.layout:
        return data
    kind = record.of(group) if group else record.array
    axes = slice(record.array.ndim)
    shape, strides = [WORD(count), WORD(columns)][axes], [WORD(8 * columns), WORD(8)][axes]
    return _view(context, builder, kind, data, shape, strides)


@lower_getattr_generic(Record)
def _of_array(context: Any, builder: Any, record: Record, value: Any, name: str) -> Any:
    """A view, a number, or the record of a part."""
    rows = builder.extract_value(value, 0)
    if name == "rows":
        return impl_ret_borrowed(context, builder, record.array, rows)
    group, place = record.layout.groups[name], context.data_model_manager[record.array].get_field_position
    fields = (builder.extract_value(rows, place(field)) for field in ("data", "shape", "strides", "meminfo"))
    data, shape, strides, owner = fields
    shape, strides = cgutils.unpack_tuple(builder, shape), cgutils.unpack_tuple(builder, strides)
    data = cgutils.pointer_add(builder, data, builder.mul(strides[0], WORD(group.first)), data.type)
    shape[0] = WORD(group.count) if group.place.stop else builder.sub(shape[0], WORD(group.first))
    kind = record.of(group)
    if not group.layout:
        return _view(context, builder, kind, data, shape, strides, owner)
    return _record(context, builder, kind, _view(context, builder, record.array, data, shape, strides, owner))


def _record(context: Any, builder: Any, record: Record, array: Any) -> Any:
    return builder.insert_value(ir.Constant(context.get_value_type(record), ir.Undefined), array, 0)


def _view(context: Any, builder: Any, kind: Any, data: Any, shape: Any, strides: Any, owner: Any = None) -> Any:
    """An array of the last of ``shape`` and ``strides``, or the number at a place."""
    if not isinstance(kind, types.Array):
        return builder.load(data)
    axes = slice(-kind.ndim, None)
    fields = {
        "data": data, "shape": cgutils.pack_array(builder, shape[axes], WORD), "itemsize": WORD(8),
        "strides": cgutils.pack_array(builder, strides[axes], WORD), "nitems": functools.reduce(builder.mul, shape[axes]),
    }  # fmt: skip
    if owner is not None:
        fields["meminfo"] = owner
    place, made = context.data_model_manager[kind].get_field_position, context.get_constant_null(kind)
    for field, part in fields.items():
        made = builder.insert_value(made, part, place(field))
    return impl_ret_borrowed(context, builder, kind, made)
