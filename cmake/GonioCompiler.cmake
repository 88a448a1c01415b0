# Compiler flags every gonio target shares: warnings, sanitizers, assertions, coverage.
# They live on the interface target gonio_compiler, which gonio_add_library() and its sisters
# link PRIVATE, so that nothing leaks into what an installed library asks of its users.

find_program(GONIO_CCACHE ccache)
mark_as_advanced(GONIO_CCACHE)
if(GONIO_CCACHE AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${GONIO_CCACHE}")
endif()

add_library(gonio_compiler INTERFACE)

# -Wconversion without -Wsign-conversion: Eigen's indices are signed, the standard library's are
# not, and a cast at each meeting would hide the conversions that matter.
target_compile_options(gonio_compiler INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  -Wnon-virtual-dtor -Woverloaded-virtual -Wcast-qual -Wformat=2 -Wimplicit-fallthrough
  -Wextra-semi -Wundef -Wunused -Wvla
  # One rounding per operation: with fused multiply-add the same formula gives other bytes
  # in a debug than in a release build, and on arm64 than on x86-64.
  -ffp-contract=off)

if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(gonio_compiler INTERFACE
    -Wduplicated-cond -Wlogical-op
    # GCC 12 reports overlaps in "literal" + std::string that cannot happen (GCC bug 105651).
    -Wno-restrict
    # These come from the optimiser's view after inlining and are wrong about Eigen and
    # std::vector often enough; they stay visible but do not stop a build.
    -Wno-error=maybe-uninitialized -Wno-error=array-bounds
    -Wno-error=stringop-overflow -Wno-error=stringop-overread)
endif()

if(GONIO_WARNINGS_AS_ERRORS)
  target_compile_options(gonio_compiler INTERFACE -Werror)
endif()

if(GONIO_ASSERTIONS)
  target_compile_definitions(gonio_compiler INTERFACE _GLIBCXX_ASSERTIONS)
  foreach(config IN ITEMS RELEASE RELWITHDEBINFO MINSIZEREL)
    string(REPLACE "-DNDEBUG" "" CMAKE_CXX_FLAGS_${config} "${CMAKE_CXX_FLAGS_${config}}")
  endforeach()
endif()

if(GONIO_SANITIZE)
  target_compile_options(gonio_compiler INTERFACE
    -fsanitize=${GONIO_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer
    # The instrumentation itself confuses the flow analysis behind this one.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_link_options(gonio_compiler INTERFACE -fsanitize=${GONIO_SANITIZE})
endif()

if(GONIO_COVERAGE)
  target_compile_options(gonio_compiler INTERFACE --coverage -fprofile-update=atomic)
  target_link_options(gonio_compiler INTERFACE --coverage)
endif()
