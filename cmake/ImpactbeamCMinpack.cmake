# C/C++ Minpack, least squares: cminpack::cminpack. Fortran calls it through iso_c_binding, so no header is needed. Its own
# configuration names targets differently from release to release.
if(NOT TARGET cminpack::cminpack)
  find_library(CMINPACK_LIBRARY NAMES cminpack cminpack_s)
  include(FindPackageHandleStandardArgs)
  find_package_handle_standard_args(CMinpack REQUIRED_VARS CMINPACK_LIBRARY NAME_MISMATCHED)
  if(NOT CMinpack_FOUND)
    message(FATAL_ERROR "cminpack is needed; on Debian: apt-get install libcminpack-dev")
  endif()
  add_library(cminpack::cminpack UNKNOWN IMPORTED)
  set_target_properties(cminpack::cminpack PROPERTIES IMPORTED_LOCATION "${CMINPACK_LIBRARY}")
endif()
