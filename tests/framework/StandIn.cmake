# The stand-in for pFUnit: a `funit` module and add_pfunit_ctest() with the arguments that we use.

set(STANDIN_DIR "${CMAKE_CURRENT_LIST_DIR}")

# One executable of some .pf files.
function(add_standin_executable name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES")
  set(sources)
  set(modules)
  foreach(source IN LISTS arg_TEST_SOURCES)
    cmake_path(GET source STEM stem)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE OUTPUT_VARIABLE input)
    set(output "${CMAKE_CURRENT_BINARY_DIR}/${stem}.f90")
    add_custom_command(OUTPUT "${output}"
      COMMAND ${python_command} "${STANDIN_DIR}/translate_pf.py" file "${input}" "${output}"
      DEPENDS "${input}" "${STANDIN_DIR}/translate_pf.py" VERBATIM)
    list(APPEND sources "${output}")
    list(APPEND modules "${stem}")
  endforeach()
  set(driver "${CMAKE_CURRENT_BINARY_DIR}/${name}_driver.f90")
  add_custom_command(OUTPUT "${driver}"
    COMMAND ${python_command} "${STANDIN_DIR}/translate_pf.py" driver "${driver}" ${modules}
    DEPENDS "${STANDIN_DIR}/translate_pf.py" VERBATIM)
  add_executable(${name} ${sources} ${arg_OTHER_SOURCES} "${driver}")
  set_target_properties(${name} PROPERTIES
    Fortran_MODULE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/${name}_modules"
    Fortran_PREPROCESS OFF)
  target_link_libraries(${name} PRIVATE funit_standin ${arg_LINK_LIBRARIES})
endfunction()

function(add_pfunit_ctest name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES;LABELS")
  add_standin_executable(${name}
    TEST_SOURCES ${arg_TEST_SOURCES}
    OTHER_SOURCES ${arg_OTHER_SOURCES}
    LINK_LIBRARIES ${arg_LINK_LIBRARIES})
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS "${arg_LABELS}")
endfunction()
