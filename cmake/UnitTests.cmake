# The unit test framework: pFUnit where it is installed, else the stand-in under tests/framework/. Test lists
# call unit_tests(), which is written once for both.

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

# unit_tests(<name> TEST_SOURCES <.pf files> [LINK_LIBRARIES ...] [LABELS ...] [ENVIRONMENT <NAME=value>...])
#
# A suite passes only if it says so with a count above zero: a `stop` inside tested code ends with status 0.
# Where that is asked for, ctest does not look at the status, so what a sanitizer says counts as failure too.
function(unit_tests name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES;LABELS;ENVIRONMENT")
  add_pfunit_ctest(test_${name}
    TEST_SOURCES ${arg_TEST_SOURCES}
    OTHER_SOURCES ${arg_OTHER_SOURCES}
    LINK_LIBRARIES ${arg_LINK_LIBRARIES}
    LABELS ${arg_LABELS})
  set_tests_properties(test_${name} PROPERTIES
    PASS_REGULAR_EXPRESSION "OK[ \r\n]+[(][1-9][0-9]* tests?[)]"
    FAIL_REGULAR_EXPRESSION "Failures: [1-9];Errors: [1-9];Sanitizer;runtime error:;Program received signal")
  if(arg_ENVIRONMENT)
    set_tests_properties(test_${name} PROPERTIES ENVIRONMENT "${arg_ENVIRONMENT}")
  endif()
  if(IMPACTBEAM_SANITIZE)
    # the main program's flags decide which exceptions trap
    target_compile_options(test_${name} PRIVATE $<$<COMPILE_LANGUAGE:Fortran>:-ffpe-trap=invalid,zero,overflow>)
    target_link_options(test_${name} PRIVATE -fsanitize=address,undefined)
  endif()
endfunction()
