cmake_policy(VERSION 3.25)

# Writes OUTPUT with the git revision of SOURCE: "1a2b3c4d5e6f", "1a2b3c4d5e6f-dirty", or "unknown"
# without git, outside a clone, or in a clone without a commit.
set(revision unknown)
if(GIT)
  # The ceiling keeps git from taking the history of a repository this tree merely lies in.
  get_filename_component(parent "${SOURCE}" DIRECTORY)
  set(ENV{GIT_CEILING_DIRECTORIES} "${parent}")
  # A build must not take git's index lock from somebody who is committing.
  set(ENV{GIT_OPTIONAL_LOCKS} 0)
  execute_process(
    COMMAND ${GIT} -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=*
    OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE
    ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed AND described)
    set(revision "${described}")
  endif()
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT "#define GONIO_REVISION \"@revision@\"\n" @ONLY)
