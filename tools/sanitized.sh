#!/bin/sh
# Run a Python whose pbrdf._kernels is built under the sanitizers: PYTHON ARGUMENT...
set -eu
kernels=$("$1" -c 'import importlib.util as u; print(u.find_spec("pbrdf").submodule_search_locations[0])')
nm -D --undefined-only "$kernels"/_kernels*.so | grep -q __asan_report || {
    echo "pbrdf._kernels of $1 is not built under AddressSanitizer" >&2
    exit 1
}
# Python itself is not built under it: the libraries have to be there before it, and what CPython keeps to its end
# would be told as leaks. No other check is off, and nothing is suppressed.
LD_PRELOAD="$(g++ -print-file-name=libasan.so) $(g++ -print-file-name=libubsan.so) $(g++ -print-file-name=libstdc++.so)"
ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1:detect_stack_use_after_return=1
UBSAN_OPTIONS=print_stacktrace=1
# Python's own allocator would hide the ends of small arrays
PYTHONMALLOC=malloc
export PYTHONMALLOC LD_PRELOAD ASAN_OPTIONS UBSAN_OPTIONS
exec "$@"
