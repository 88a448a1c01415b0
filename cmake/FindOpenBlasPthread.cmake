# Debian's libopenblas-pthread-dev as gonio::openblas, one thread per call (docs/adr/0001).
#
# Debian keeps the serial, pthread and OpenMP builds in sibling folders and lets an alternatives
# link choose one of them; we name the folder, so what else is installed does not matter. The
# serial build is not an option: it takes no lock around its buffer table, and two threads inside
# it now and then compute on the same buffer.

find_path(OPENBLAS_PTHREAD_INCLUDE_DIR cblas.h
  PATHS /usr/include/${CMAKE_LIBRARY_ARCHITECTURE}/openblas-pthread
  NO_DEFAULT_PATH)
find_library(OPENBLAS_PTHREAD_LIBRARY openblas
  PATHS /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/openblas-pthread
  NO_DEFAULT_PATH)
mark_as_advanced(OPENBLAS_PTHREAD_INCLUDE_DIR OPENBLAS_PTHREAD_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenBlasPthread
  REQUIRED_VARS OPENBLAS_PTHREAD_LIBRARY OPENBLAS_PTHREAD_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "install Debian's libopenblas-pthread-dev, or run ./dev setup")

if(OpenBlasPthread_FOUND AND NOT TARGET gonio::openblas)
  add_library(openblas_pthread SHARED IMPORTED)
  set_target_properties(openblas_pthread PROPERTIES
    IMPORTED_LOCATION "${OPENBLAS_PTHREAD_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${OPENBLAS_PTHREAD_INCLUDE_DIR}")

  add_library(gonio_openblas STATIC ${CMAKE_CURRENT_LIST_DIR}/openblas/settings.cpp)
  target_link_libraries(gonio_openblas
    PUBLIC openblas_pthread
    PRIVATE $<BUILD_INTERFACE:gonio_compiler>)
  # Nothing calls into this library: the undefined symbol makes the linker take its initialiser.
  target_link_options(gonio_openblas INTERFACE "LINKER:--undefined=gonio_openblas_settings")
  add_library(gonio::openblas ALIAS gonio_openblas)
endif()
