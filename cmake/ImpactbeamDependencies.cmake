# The libraries of others, each a target for those of the project: impactbeam_lapack, impactbeam_hdf5, impactbeam_zlib,
# impactbeam_cminpack, and where there is OpenMP impactbeam_openmp.
#
# To load HDF5 with what it brings (curl, TLS, Kerberos, for a driver that is never used) takes longer than a short run. So the
# program `impactbeam` (a target with the property IMPACTBEAM_STATIC) links archives, where there are some beside the shared
# libraries and a trial shows that they do; all else links what CMake found.

include(CheckLinkerFlag)
include(CheckSourceCompiles)

find_package(LAPACK REQUIRED)
find_package(HDF5 REQUIRED COMPONENTS Fortran HL)
include(ImpactbeamHDF5)
find_package(ZLIB REQUIRED)
include(ImpactbeamCMinpack)
find_package(OpenMP COMPONENTS Fortran)
if(IMPACTBEAM_MPI)
  find_package(MPI COMPONENTS C)
endif()
set(IMPACTBEAM_MPI_FOUND "${MPI_C_FOUND}")
message(STATUS "Sweeps: threads ${OpenMP_Fortran_FOUND}, processes by MPI ${IMPACTBEAM_MPI_FOUND}")

# archives_of(<variable> <libraries...>): each as an archive, where that lies beside it; not parts of the C library
function(archives_of variable)
  set(found "")
  foreach(library IN LISTS ARGN)
    set(chosen "${library}")
    if(EXISTS "${library}" AND library MATCHES "\\.so$" AND NOT library MATCHES "/libm\\.so$")
      file(REAL_PATH "${library}" real)
      string(REGEX REPLACE "\\.so[.0-9]*$" ".a" beside "${library}")
      string(REGEX REPLACE "\\.so[.0-9]*$" ".a" real "${real}")
      foreach(archive IN ITEMS "${beside}" "${real}")
        if(EXISTS "${archive}")
          set(chosen "${archive}")
        endif()
      endforeach()
    endif()
    list(APPEND found "${chosen}")
    # what libsz's archive needs
    string(REGEX REPLACE "/libsz\\.a$" "/libaec.a" needed "${chosen}")
    if(NOT needed STREQUAL chosen AND EXISTS "${needed}")
      list(APPEND found "${needed}")
    endif()
  endforeach()
  set(${variable} "${found}" PARENT_SCOPE)
endfunction()

set(IMPACTBEAM_LINKED_STATICALLY "")
set(IMPACTBEAM_STATIC_FLAGS "")

# links_statically(<variable> <Fortran program> <libraries and flags...>)
function(links_statically variable source)
  set(CMAKE_REQUIRED_QUIET ON)
  set(CMAKE_REQUIRED_LINK_OPTIONS -Wl,--as-needed)
  set(CMAKE_REQUIRED_INCLUDES ${HDF5_Fortran_INCLUDE_DIRS})
  set(CMAKE_REQUIRED_LIBRARIES ${ARGN})
  check_source_compiles(Fortran "${source}" ${variable} SRC_EXT f90)
  set(${variable} "${${variable}}" PARENT_SCOPE)
endfunction()

# impactbeam_dependency(<name> TARGETS <targets...> LIBRARIES <files...> PROBE <Fortran program>)
function(impactbeam_dependency name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "PROBE" "TARGETS;LIBRARIES")
  add_library(impactbeam_${name} INTERFACE)
  add_library(impactbeam_${name}_shared INTERFACE)
  target_link_libraries(impactbeam_${name}_shared INTERFACE ${arg_TARGETS})
  set(chosen impactbeam_${name}_shared)
  archives_of(archives ${arg_LIBRARIES})
  list(GET archives 0 first)
  if(IMPACTBEAM_STATIC AND NOT IMPACTBEAM_SANITIZE AND first MATCHES "\\.a$")
    links_statically(IMPACTBEAM_STATIC_${name} "${arg_PROBE}" ${archives})
    if(IMPACTBEAM_STATIC_${name})
      add_library(impactbeam_${name}_static INTERFACE)
      target_link_libraries(impactbeam_${name}_static INTERFACE ${archives})
      set(chosen impactbeam_${name}_static)
      set(IMPACTBEAM_LINKED_STATICALLY ${IMPACTBEAM_LINKED_STATICALLY} ${name} PARENT_SCOPE)
    endif()
  endif()
  target_link_libraries(impactbeam_${name} INTERFACE
    "$<IF:$<BOOL:$<TARGET_PROPERTY:IMPACTBEAM_STATIC>>,${chosen},impactbeam_${name}_shared>")
endfunction()

impactbeam_dependency(lapack TARGETS LAPACK::LAPACK LIBRARIES ${LAPACK_LIBRARIES}
  PROBE "external :: dgemm, dsyev\n call dgemm\n call dsyev\n end")
impactbeam_dependency(hdf5 TARGETS hdf5::hdf5_fortran hdf5::hdf5_hl_fortran
  LIBRARIES ${HDF5_Fortran_HL_LIBRARIES} ${HDF5_Fortran_LIBRARIES}
  PROBE "use hdf5\n use h5ds\n integer(hid_t) :: id\n integer :: status\n call h5open_f(status)\n
    call h5dsset_scale_f(id, status, 'x')\n end")
impactbeam_dependency(zlib TARGETS ZLIB::ZLIB LIBRARIES ${ZLIB_LIBRARIES} 
  PROBE "interface\n subroutine crc32() bind(c)\n end subroutine\n end interface\n call crc32()\n end")
impactbeam_dependency(cminpack TARGETS cminpack::cminpack LIBRARIES ${CMINPACK_LIBRARY}
  PROBE "interface\n subroutine lmdif() bind(c)\n end subroutine\n end interface\n call lmdif()\n end")

if(OpenMP_Fortran_FOUND)
  impactbeam_dependency(openmp TARGETS OpenMP::OpenMP_Fortran LIBRARIES ${OpenMP_gomp_LIBRARY} ${OpenMP_pthread_LIBRARY}
    PROBE "integer, external :: omp_get_thread_num\n print *, omp_get_thread_num()\n end")
endif()

# All of them are in Fortran's one library.
if("hdf5" IN_LIST IMPACTBEAM_LINKED_STATICALLY AND "lapack" IN_LIST IMPACTBEAM_LINKED_STATICALLY)
  links_statically(IMPACTBEAM_STATIC_fortran "print *, 1\n end" -static-libgfortran -static-libgcc)
  if(IMPACTBEAM_STATIC_fortran)
    list(APPEND IMPACTBEAM_LINKED_STATICALLY fortran)
    list(APPEND IMPACTBEAM_STATIC_FLAGS -static-libgfortran -static-libgcc
      -Wl,--wrap=_gfortran_os_error,--wrap=_gfortran_os_error_at)
  endif()
endif()
if(IMPACTBEAM_LINKED_STATICALLY)
  list(APPEND IMPACTBEAM_STATIC_FLAGS -Wl,--as-needed)
endif()
# blas_threads.c goes before OpenBLAS's own.
if("lapack" IN_LIST IMPACTBEAM_LINKED_STATICALLY AND "${LAPACK_LIBRARIES}" MATCHES "openblas")
  list(APPEND IMPACTBEAM_STATIC_FLAGS -Wl,--undefined=openblas_set_num_threads,--wrap=openblas_num_threads_env)
endif()
list(JOIN IMPACTBEAM_LINKED_STATICALLY ", " linked_statically)
message(STATUS "Programs link statically: ${linked_statically}")
