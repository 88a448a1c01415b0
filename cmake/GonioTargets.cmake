# gonio_add_library(NAME [INTERFACE] [SOURCES file...] [PUBLIC target...] [PRIVATE target...])
#
#   Library gonio_NAME, alias gonio::NAME, exporting only the folder's own include/ (headers are
#   included as "gonio/NAME/..."). PUBLIC names what appears in its headers, PRIVATE what only its
#   sources use; everything else is out of reach, which is how the layering table is enforced.
#   INTERFACE is for libraries without sources.
#
#   With GONIO_UNITY_BUILD its sources are compiled several at a time, so names in unnamed namespaces
#   must be unique within the target. The dev preset compiles them one by one and finds what is
#   included by luck only.
function(gonio_add_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "INTERFACE" "" "SOURCES;PUBLIC;PRIVATE")
  gonio_refuse_unparsed("gonio_add_library(${name})" ${arg_UNPARSED_ARGUMENTS})

  if(arg_INTERFACE)
    if(arg_SOURCES OR arg_PRIVATE)
      message(FATAL_ERROR "gonio_add_library(${name}): INTERFACE takes PUBLIC only.")
    endif()
    add_library(gonio_${name} INTERFACE)
    target_include_directories(gonio_${name} INTERFACE ${CMAKE_CURRENT_SOURCE_DIR}/include)
    target_link_libraries(gonio_${name} INTERFACE ${arg_PUBLIC})
  else()
    add_library(gonio_${name} STATIC ${arg_SOURCES})
    gonio_compile_in_batches(gonio_${name})
    target_include_directories(gonio_${name} PUBLIC ${CMAKE_CURRENT_SOURCE_DIR}/include)
    target_link_libraries(gonio_${name}
      PUBLIC ${arg_PUBLIC}
      PRIVATE ${arg_PRIVATE} gonio_compiler)
  endif()
  add_library(gonio::${name} ALIAS gonio_${name})
endfunction()

# gonio_add_executable(NAME SOURCES file... [LIBS target...])
#
#   A program called NAME in <build>/bin.
function(gonio_add_executable name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBS")
  gonio_refuse_unparsed("gonio_add_executable(${name})" ${arg_UNPARSED_ARGUMENTS})
  add_executable(${name} ${arg_SOURCES})
  gonio_compile_in_batches(${name})
  target_link_libraries(${name} PRIVATE ${arg_LIBS} gonio_compiler)
endfunction()

# gonio_add_test(NAME SOURCES file... [LIBS target...] [LABELS label...] [TIMEOUT seconds]
#                [ENVIRONMENT NAME=value...] [DEPENDS target...]
#                [ONE_PROCESS | SHARDS count])
#
#   One GoogleTest program, NAME_test, whose cases ctest sees one by one and runs in processes of
#   their own. ONE_PROCESS runs the whole program as a single ctest entry instead: for suites with
#   an expensive shared fixture. SHARDS runs it as `count` entries, each with its part of the cases.
#   GMock and main() are linked.
#
#   Compiled in batches as the libraries are: what several files of a test use belongs in a header of
#   its folder, and what differs between them needs names of its own.
#
#   Labels   unit (the default), untrusted (readers of untrusted files; for asan, too),
#            scenario (whole sessions), slow, real_data (needs GONIO_REAL_DATA), wire, hardware.
#   DEPENDS  further targets the test runs, such as the gonio program.
function(gonio_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg
    "ONE_PROCESS" "TIMEOUT;SHARDS" "SOURCES;LIBS;LABELS;ENVIRONMENT;DEPENDS")
  gonio_refuse_unparsed("gonio_add_test(${name})" ${arg_UNPARSED_ARGUMENTS})
  if(NOT arg_LABELS)
    set(arg_LABELS unit)
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  if(GONIO_SANITIZE)
    math(EXPR arg_TIMEOUT "${arg_TIMEOUT} * 5")
  endif()

  set(target ${name}_test)
  add_executable(${target} ${arg_SOURCES})
  if(NOT GONIO_SANITIZE)  # not tried with that: what instrumented batches take, and what GCC sees in them
    gonio_compile_in_batches(${target})
    # A test runs once for each time it is compiled, which takes longer: a third less so.
    target_compile_options(${target} PRIVATE $<$<CONFIG:RelWithDebInfo>:-O1>)
  endif()
  target_link_libraries(${target} PRIVATE ${arg_LIBS} GTest::gmock_main gonio_compiler)
  if(arg_DEPENDS)
    add_dependencies(${target} ${arg_DEPENDS})
  endif()

  # The suite says itself what it needs; an inherited setting must not change what it proves.
  set(environment OPENBLAS_NUM_THREADS=1 ${arg_ENVIRONMENT})
  if("wire" IN_LIST arg_LABELS)
    # umockdev takes every file below /dev for a device and ends a program after fifty of them.
    list(APPEND environment GONIO_TEST_FOLDERS_ON_DISK=1)
  endif()
  if(arg_SHARDS)
    math(EXPR last "${arg_SHARDS} - 1")
    foreach(shard RANGE ${last})
      add_test(NAME ${name}_${shard} COMMAND ${target})
      set_tests_properties(${name}_${shard} PROPERTIES
        LABELS "${arg_LABELS}" TIMEOUT ${arg_TIMEOUT}
        ENVIRONMENT "${environment};GTEST_TOTAL_SHARDS=${arg_SHARDS};GTEST_SHARD_INDEX=${shard}")
    endforeach()
  elseif(arg_ONE_PROCESS)
    add_test(NAME ${name} COMMAND ${target})
    set_tests_properties(${name} PROPERTIES
      LABELS "${arg_LABELS}" TIMEOUT ${arg_TIMEOUT} ENVIRONMENT "${environment}")
  else()
    gtest_discover_tests(${target}
      DISCOVERY_MODE PRE_TEST  # building must not run what it builds
      PROPERTIES
        LABELS "${arg_LABELS}" TIMEOUT ${arg_TIMEOUT} ENVIRONMENT "${environment}")
  endif()

  # `cmake --build --target gonio_unit_tests` builds what `ctest -L unit` runs.
  foreach(label IN LISTS arg_LABELS)
    if(NOT TARGET gonio_${label}_tests)
      add_custom_target(gonio_${label}_tests)
    endif()
    add_dependencies(gonio_${label}_tests ${target})
  endforeach()
endfunction()

# gonio_add_benchmark(NAME SOURCES file... [LIBS target...])
#
#   One Google Benchmark program, NAME_benchmark. Never part of ctest.
function(gonio_add_benchmark name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBS")
  gonio_refuse_unparsed("gonio_add_benchmark(${name})" ${arg_UNPARSED_ARGUMENTS})
  add_executable(${name}_benchmark ${arg_SOURCES})
  target_link_libraries(${name}_benchmark
    PRIVATE ${arg_LIBS} benchmark::benchmark_main gonio_compiler)
endfunction()

# Reading Eigen, GoogleTest, the JSON and the command line headers takes longer than compiling what
# uses them. Sources with compile options of their own stay alone.
function(gonio_compile_in_batches target)
  set_target_properties(${target} PROPERTIES
    UNITY_BUILD ${GONIO_UNITY_BUILD} UNITY_BUILD_BATCH_SIZE 12)
endfunction()

function(gonio_refuse_unparsed caller)
  if(ARGN)
    message(FATAL_ERROR "${caller}: unknown arguments: ${ARGN}")
  endif()
endfunction()
