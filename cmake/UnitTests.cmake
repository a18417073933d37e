# The unit test framework: pFUnit where it is installed, else the stand-in under tests/framework/. Test lists
# call unit_tests(), which is written once for both.

include(TestFiles)

find_package(Python3 REQUIRED COMPONENTS Interpreter)
# It is started a thousand times: not through a launcher (pyenv's takes six times as long), and without its site.
execute_process(COMMAND "${Python3_EXECUTABLE}" -c "import sys; print(sys.executable)"
  OUTPUT_VARIABLE plain_python OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(python_command "${plain_python}" -I -S)

set(UNIT_FRAMEWORK auto CACHE STRING "pfunit, standin, or auto: pFUnit where it is found")
set_property(CACHE UNIT_FRAMEWORK PROPERTY STRINGS auto pfunit standin)

if(UNIT_FRAMEWORK STREQUAL "pfunit")
  find_package(PFUNIT 4.12...<5 CONFIG REQUIRED)
elseif(UNIT_FRAMEWORK STREQUAL "auto")
  find_package(PFUNIT 4.12...<5 CONFIG QUIET)
elseif(NOT UNIT_FRAMEWORK STREQUAL "standin")
  message(FATAL_ERROR "UNIT_FRAMEWORK is ${UNIT_FRAMEWORK}: must be auto, pfunit or standin")
endif()

if(PFUNIT_FOUND AND NOT UNIT_FRAMEWORK STREQUAL "standin")
  set(UNIT_FRAMEWORK_FOUND pfunit)
else()
  set(UNIT_FRAMEWORK_FOUND standin)
  include("${PROJECT_SOURCE_DIR}/tests/framework/StandIn.cmake")
endif()
message(STATUS "Unit tests with ${UNIT_FRAMEWORK_FOUND}")

# Seconds after which a suite is killed
set(seconds_a_suite 900)
if(IMPACTBEAM_SANITIZE)
  set(seconds_a_suite 6000)
endif()

# unit_tests(<name> TEST_SOURCES <.pf files> [LINK_LIBRARIES ...] [LABELS ...] [ENVIRONMENT <NAME=value>...] [SECONDS <number>])
#
# SECONDS: about so long it takes, if that is long; the longest start first, so that none is left alone at the end.
# A suite passes only if run_suite.py says so, which looks at its status, its words, its count of tests and the time.
function(unit_tests name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "SECONDS" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES;LABELS;ENVIRONMENT")
  add_pfunit_ctest(test_${name}
    TEST_SOURCES ${arg_TEST_SOURCES}
    OTHER_SOURCES ${arg_OTHER_SOURCES}
    LINK_LIBRARIES ${arg_LINK_LIBRARIES}
    LABELS ${arg_LABELS})
  if(NOT slow IN_LIST arg_LABELS)
    add_dependencies(quick_tests test_${name})
  endif()
  note_test_files(LISTED ${arg_TEST_SOURCES})
  list(TRANSFORM arg_TEST_SOURCES PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/" OUTPUT_VARIABLE files)
  # what goes before the command of add_test(), that of pFUnit's add_pfunit_ctest() too
  set(launcher CROSSCOMPILING_EMULATOR)
  if(CMAKE_VERSION VERSION_GREATER_EQUAL 3.29)
    set(launcher TEST_LAUNCHER)
  endif()
  set_property(TARGET test_${name} PROPERTY ${launcher} ${python_command}
    "${PROJECT_SOURCE_DIR}/tests/framework/run_suite.py" --timeout ${seconds_a_suite} --tests ${files} --)
  math(EXPR seconds_for_ctest "${seconds_a_suite} + 60")
  set_tests_properties(test_${name} PROPERTIES TIMEOUT ${seconds_for_ctest})
  if(arg_SECONDS)
    set_tests_properties(test_${name} PROPERTIES COST ${arg_SECONDS})
  endif()
  if(arg_ENVIRONMENT)
    set_tests_properties(test_${name} PROPERTIES ENVIRONMENT "${arg_ENVIRONMENT}")
  endif()
  if(IMPACTBEAM_SANITIZE)
    # the main program's flags decide which exceptions trap
    target_compile_options(test_${name} PRIVATE $<$<COMPILE_LANGUAGE:Fortran>:-ffpe-trap=invalid,zero,overflow>)
    target_link_options(test_${name} PRIVATE -fsanitize=address,undefined)
  endif()
endfunction()
