# Every .pf file is in one list of tests, or left out for a reason that is said.

# note_test_files(LISTED|LEFT_OUT <.pf files of this folder>)
function(note_test_files kind)
  list(TRANSFORM ARGN PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/" OUTPUT_VARIABLE files)
  set_property(GLOBAL APPEND PROPERTY TEST_FILES_${kind} ${files})
endfunction()

# tests_left_out(<why> <.pf files>): what this build cannot run
function(tests_left_out why)
  message(STATUS "Not tested: ${why}")
  note_test_files(LEFT_OUT ${ARGN})
endfunction()

# check_test_files(<folder>): after all lists; the files that run are written down for count_tests.py
function(check_test_files folder)
  file(GLOB_RECURSE found CONFIGURE_DEPENDS "${folder}/*.pf")
  list(FILTER found EXCLUDE REGEX "/self_test/")
  get_property(listed GLOBAL PROPERTY TEST_FILES_LISTED)
  get_property(left_out GLOBAL PROPERTY TEST_FILES_LEFT_OUT)
  set(lists ${listed} ${left_out})
  foreach(file IN LISTS found)
    set(others ${lists})
    list(REMOVE_ITEM others "${file}")
    list(LENGTH lists all)
    list(LENGTH others rest)
    math(EXPR times "${all} - ${rest}")
    if(NOT times EQUAL 1)
      message(SEND_ERROR "${file} is in ${times} lists of tests: must be in one")
    endif()
  endforeach()
  list(JOIN listed "\n" lines)
  file(WRITE "${CMAKE_BINARY_DIR}/Testing/pf_files.txt" "${lines}\n")
endfunction()
