"""What Numba's code calls for arrays of its own: memory that is counted, here by LLVM code for any target.

``np.empty`` in a kernel asks for a head of six words, the fourth of which is the address of the data, and counts who holds it.
"""

import re

RUNTIME = """
declare ptr @malloc(i64)
declare void @free(ptr)

define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) nounwind {
  %all = add i64 %size, 128
  %head = call ptr @malloc(i64 %all)
  %none = icmp eq ptr %head, null
  br i1 %none, label %no, label %yes
no:
  ret ptr null
yes:
  store i64 1, ptr %head
  %first = ptrtoint ptr %head to i64
  %after = add i64 %first, 111
  %even = and i64 %after, -64
  %data = getelementptr i64, ptr %head, i64 3
  store i64 %even, ptr %data
  ret ptr %head
}

define ptr @NRT_MemInfo_alloc_safe_aligned(i64 %size, i32 %align) nounwind {
  %head = call ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align)
  ret ptr %head
}

define void @NRT_incref(ptr %head) noinline nounwind {
  %none = icmp eq ptr %head, null
  br i1 %none, label %done, label %some
some:
  %old = atomicrmw add ptr %head, i64 1 monotonic
  br label %done
done:
  ret void
}

define void @NRT_decref(ptr %head) noinline nounwind {
  %none = icmp eq ptr %head, null
  br i1 %none, label %done, label %some
some:
  %old = atomicrmw sub ptr %head, i64 1 acq_rel
  %last = icmp eq i64 %old, 1
  br i1 %last, label %over, label %done
over:
  call void @free(ptr %head)
  br label %done
done:
  ret void
}
"""


def without_counts(code: str) -> str:
    """Code that calls the functions above that count, where Numba has written its own for this processor."""
    return re.sub(
        r"^define [^\n]*@(NRT_incref|NRT_decref)\(.*?^\}$", r"declare void @\1(ptr)", code, flags=re.MULTILINE | re.DOTALL
    )
