!> The one entry for other programs: run a scene from code. Link the CMake target `impactbeam::impactbeam`, or with what
!> `pkg-config --libs impactbeam` prints.
module impactbeam_library
   use blas_threads, only: single_threaded_blas
   use command_line, only: argument_t
   use failures, only: failure_t
   use program_identity, only: program_motion, program_version
   use program_run, only: check_needs, program_t, read_scenes, run_scene
   use results_file, only: results_name
   use scene_needs, only: needs_of_scene
   use scene_run, only: run_motion_scene
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: run_scene_file, impactbeam_version

   !> Version of the library
   character(*), parameter :: impactbeam_version = program_version

contains

   !> Run a scene as the program `impactbeam` does: the same checks, the same results file. Nothing is printed, nothing
   !> stops. One call at a time.
   subroutine run_scene_file(scene_file, folder, results, status, message, threads)
      !> Namelist file of the scene
      character(*), intent(in) :: scene_file
      !> Folder of the results, which is made if it is not there
      character(*), intent(in) :: folder
      !> Path of the HDF5 file that was written; empty where there is none
      character(:), allocatable, intent(out) :: results
      !> 0 done, 1 the run failed or could not be written, 2 the scene is wrong or has no room
      integer, intent(out) :: status
      !> One line: file, line, group, name, value and what is allowed; empty when done
      character(:), allocatable, intent(out) :: message
      !> Threads of a sweep; absent: one a core, at most four
      integer, intent(in), optional :: threads

      type(failure_t), allocatable :: error
      type(program_t) :: program
      type(scene_t), allocatable :: scenes(:)
      integer :: most_threads

      results = ''
      message = ''
      status = 0
      most_threads = 0
      if (present(threads)) most_threads = max(0, threads)
      program = program_t(program_motion, '', needs_of_scene, run_motion_scene)
      call single_threaded_blas()
      call read_scenes(program%number, [argument_t(scene_file)], scenes, error)
      if (.not. allocated(error)) call check_needs(program, scenes, most_threads, error)
      if (.not. allocated(error)) call run_scene(program, scenes(1), folder, most_threads, .true., error)
      if (allocated(error)) then
         status = error%status
         message = error%message
      else
         results = folder//'/'//results_name(scenes(1))
      end if
   end subroutine run_scene_file

end module impactbeam_library
