"""What is told of a Cortex-M7: stack from assembly, counted operations, names that an object needs."""

import ctypes
import json

import llvmlite.binding as llvm
import pytest

from birthsim_build.code.counting import COUNTS, OPERATIONS, counted
from birthsim_build.code.stack import stack_bytes

ASSEMBLY = """
	.type	first,%function
first:
	push.w	{r4, r5, lr}
	sub	sp, #20
	blx	r6
	bl	small
	.type	stage_a,%function
stage_a:
	push	{r4, lr}
	vpush	{d8, d9}
	sub.w	sp, sp, #400
	bl	small
	bl	__aeabi_d2lz
	.type	stage_b,%function
stage_b:
	sub	sp, #100
	.type	small,%function
small:
	push	{r7}
"""


def test_the_deepest_stack_is_that_of_the_longest_chain_of_calls():
    assert stack_bytes(ASSEMBLY, "first", "stage_") == (12 + 20) + (8 + 16 + 400) + 4
    assert stack_bytes(ASSEMBLY, "stage_b", "stage_") == 100


CODE = """
define i64 @run(i64 %n, ptr %x) {
start:
  br label %loop
loop:
  %i = phi i64 [ 0, %start ], [ %next, %loop ]
  %a = load double, ptr %x
  %b = fmul double %a, 2.0
  %c = fadd double %b, 1.0
  %d = fdiv double %c, 3.0
  %e = call double @llvm.sqrt.f64(double %d)
  store double %e, ptr %x
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, %n
  br i1 %more, label %loop, label %end
end:
  ret i64 %next
}
declare double @llvm.sqrt.f64(double)
"""


def test_operations_are_counted_as_they_are_executed():
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    module = llvm.parse_assembly(counted(CODE))
    engine = llvm.create_mcjit_compiler(module, llvm.Target.from_default_triple().create_target_machine())
    engine.finalize_object()
    run = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p)(engine.get_function_address("run"))
    counts = (ctypes.c_int64 * len(OPERATIONS)).from_address(engine.get_global_value_address(COUNTS))
    value = ctypes.c_double(1.0)
    assert run(7, ctypes.addressof(value)) == 7
    expected = {"product": 7, "sum": 7, "quotient": 7, "root": 7, "memory": 14, "whole": 14, "branch": 8}
    assert dict(zip(OPERATIONS, counts, strict=True)) == {name: expected.get(name, 0) for name in OPERATIONS}


@pytest.mark.slow
def test_the_object_needs_no_more_than_arm_s_conversions(cortex):
    report = json.loads((cortex / "build.json").read_text())
    assert {"__aeabi_d2lz", "__aeabi_l2d", "__aeabi_ldivmod", "__aeabi_memclr8", "__aeabi_ul2d"} >= set(report["needs"])
    assert report["bss"] == report["data"] == 0
    assert 0 < report["stack"] < 2048
    assert all(found["most"] < 400_000 for found in report["estimate"].values())  # a period at 400 MHz
