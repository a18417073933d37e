!> The entry point for other programs, which runs a scene from code. Link the CMake target `impactbeam::impactbeam`, or
!> the libraries that `pkg-config --libs impactbeam` prints.
module impactbeam_library
   use command_line, only: argument_t
   use failures, only: failure_t
   use lapack_interfaces, only: single_threaded_blas
   use program_identity, only: program_motion, program_version
   use program_run, only: check_memory_needs, program_t, read_scenes, run_scene
   use results_file, only: results_name
   use scene_needs, only: memory_need_of_scene
   use scene_run, only: run_motion_scene
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: run_scene_file, impactbeam_version

   !> Version of the library
   character(*), parameter :: impactbeam_version = program_version

contains

   !> Run a scene as the program `impactbeam` does, with the same checks and the same results file. The procedure
   !> neither prints nor stops the caller. It must not be called concurrently.
   subroutine run_scene_file(scene_file, folder, results, status, message, threads)
      !> Namelist file of the scene
      character(*), intent(in) :: scene_file
      !> Folder of the results, which is made if it does not exist
      character(*), intent(in) :: folder
      !> Path of the HDF5 file that was written; empty if there is none
      character(:), allocatable, intent(out) :: results
      !> 0: done, 1: the run failed or its file could not be written, 2: the scene is invalid or exceeds the memory
      integer, intent(out) :: status
      !> One line with file, line, group, name, value and the allowed values; empty if the run is done
      character(:), allocatable, intent(out) :: message
      !> Number of threads of a sweep; absent: one per core, at most four
      integer, intent(in), optional :: threads

      type(failure_t), allocatable :: error
      type(program_t) :: program
      type(scene_t), allocatable :: scenes(:)
      ! 0: as many threads as there are cores, at most four
      integer :: thread_count

      results = ''
      message = ''
      status = 0
      thread_count = 0
      if (present(threads)) thread_count = max(0, threads)
      program = program_t(program_motion, '', memory_need_of_scene, run_motion_scene)
      call single_threaded_blas()
      call read_scenes(program%number, [argument_t(scene_file)], scenes, error)
      if (.not. allocated(error)) call check_memory_needs(program, scenes, thread_count, error)
      if (.not. allocated(error)) call run_scene(program, scenes(1), folder, thread_count, .true., error)
      if (allocated(error)) then
         status = error%status
         message = error%message
      else
         results = folder//'/'//results_name(scenes(1))
      end if
   end subroutine run_scene_file

end module impactbeam_library
