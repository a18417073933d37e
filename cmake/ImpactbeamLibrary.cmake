# Flags and the shape of the project's own libraries.
#
# impactbeam_library(<name> SOURCES <files...> [LINKS <targets...>] [NO_INNER_LOOPS])
#   makes one static library of one folder of src/. The libraries it may use are only those it
#   links, so the direction in which data flows is enforced by the build.
#   NO_INNER_LOOPS: what reads, writes and arranges is compiled in half the time, at -O1.
#
# impactbeam_program(<name> SOURCES <file of the main program> LINKS <library>)

# CMake ends a path that the installation rewrites with an empty part, and the dynamic linker takes that for the current
# folder: the paths are final from the start
set(CMAKE_BUILD_WITH_INSTALL_RPATH ON)
set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON CACHE BOOL "Installed programs find libraries outside the folders of the system")

add_library(impactbeam_flags INTERFACE)
if(CMAKE_Fortran_COMPILER_ID STREQUAL "GNU")
  target_compile_options(impactbeam_flags INTERFACE
    # threads of a sweep are in one procedure at once: no local variable may be static
    -frecursive
    -Wall -Wextra -Wconversion-extra -Wimplicit-interface -Wimplicit-procedure)
endif()
target_compile_options(impactbeam_flags INTERFACE
  -std=f2018
  $<$<BOOL:${IMPACTBEAM_WERROR}>:-Werror>
  $<$<AND:$<CONFIG:Release>,$<BOOL:${IMPACTBEAM_NATIVE}>>:-march=native>
  # without the assignments of variables, which take minutes to track in some files
  $<$<CONFIG:Debug>:-Og> $<$<CONFIG:Debug>:-g> $<$<CONFIG:Debug>:-fno-var-tracking-assignments>
  $<$<BOOL:${IMPACTBEAM_SANITIZE}>:-fcheck=all,no-array-temps>
  $<$<BOOL:${IMPACTBEAM_SANITIZE}>:-fbacktrace>
  $<$<BOOL:${IMPACTBEAM_SANITIZE}>:-ffpe-trap=invalid,zero,overflow>
  $<$<BOOL:${IMPACTBEAM_SANITIZE}>:-fsanitize=address,undefined>
  # gfortran takes the difference of an unallocated array's bounds before it sees that there are none
  $<$<BOOL:${IMPACTBEAM_SANITIZE}>:-fno-sanitize=signed-integer-overflow>)
target_link_options(impactbeam_flags INTERFACE
  $<$<BOOL:${IMPACTBEAM_SANITIZE}>:-fsanitize=address,undefined>)

function(impactbeam_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "NO_INNER_LOOPS" "" "SOURCES;LINKS")
  add_library(${name} STATIC ${arg_SOURCES})
  # the module of a file that has moved to another folder would be found before the new one
  file(GLOB modules RELATIVE "${CMAKE_CURRENT_BINARY_DIR}/modules" "${CMAKE_CURRENT_BINARY_DIR}/modules/*.mod")
  foreach(module IN LISTS modules)
    string(REPLACE ".mod" ".f90" source "${module}")
    if(NOT source IN_LIST arg_SOURCES)
      file(REMOVE "${CMAKE_CURRENT_BINARY_DIR}/modules/${module}")
    endif()
  endforeach()
  if(arg_NO_INNER_LOOPS)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  set_target_properties(${name} PROPERTIES
    Fortran_MODULE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/modules"
    Fortran_PREPROCESS OFF)
  target_include_directories(${name} PUBLIC
    "$<BUILD_INTERFACE:${CMAKE_CURRENT_BINARY_DIR}/modules>")
  target_link_libraries(${name} PUBLIC ${arg_LINKS} PRIVATE "$<BUILD_INTERFACE:impactbeam_flags>")
endfunction()

# impactbeam_program(<name> SOURCES ... LINKS ... [SHARED]): SHARED: it is small, because it links the shared libraries of others
function(impactbeam_program name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "SHARED" "" "SOURCES;LINKS")
  set(static_flags ${IMPACTBEAM_STATIC_FLAGS})
  set(linked_statically "${IMPACTBEAM_LINKED_STATICALLY}")
  if(arg_SHARED)
    set(static_flags "")
    set(linked_statically "")
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINKS} impactbeam_flags)
  target_link_options(${name} PRIVATE ${static_flags}
    # the sanitizer calls dlopen() for the program, and has another path to search
    $<$<BOOL:${IMPACTBEAM_SANITIZE}>:-Wl,--disable-new-dtags>)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}"
    IMPACTBEAM_STATIC "${linked_statically}")
  if(TARGET impactbeam_ranks)
    add_dependencies(${name} impactbeam_ranks)
    set_property(TARGET ${name} PROPERTY INSTALL_RPATH "\$ORIGIN")
  endif()
endfunction()
