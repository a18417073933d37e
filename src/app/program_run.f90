!> A complete run of one of the programs: arguments, scenes, messages and exit status. The run is a procedure so that
!> all its memory is freed before the program stops.
module program_run
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: error_unit
   use command_line, only: argument_t, command_line_t, get_arguments, parse_arguments, usage
   use failures, only: fail, failure_t, status_bad_input
   use file_system, only: existing_part, remove_empty_folders
   use lapack_interfaces, only: single_threaded_blas
   use memory_needs, only: check_need, memory_need_t
   use name_list, only: write_names
   use process, only: open_text, prepare_process, print_text, text_of, run_on_default_stack
   use program_identity, only: name_of_program, program_motion, program_version
   use results_claim, only: claim_results, claim_t, release_results
   use results_file, only: results_name
   use scene_checks, only: check_scene, failing_cases, locate_failure
   use scene_reader, only: complain_of_scene, read_scene
   use scene_resolve, only: problem_with_damping
   use scene_templates, only: template_text
   use scene_types, only: scene_t
   use study_job, only: job_t
   use sweep_ranks, only: max_of_ranks, is_first_rank, start_ranks, stop_ranks
   use table_files, only: write_table_files
   implicit none (type, external)
   private
   public :: program_t, run_program, read_scenes, check_memory_needs, run_scene

   !> The properties that distinguish the programs.
   type :: program_t
      !> One of the `program_` constants
      integer :: number = 0
      !> Purpose of the program, a line of its help
      character(:), allocatable :: purpose
      !> Estimate the memory that a scene needs
      procedure(needs_interface), pointer, nopass :: memory_need_of => null()
      !> Compute a scene
      procedure(run_interface), pointer, nopass :: run => null()
      !> Example of a first use, lines ended by new_line('a'); unallocated: none
      character(:), allocatable :: example
   end type program_t

   !> A run of a program and its exit status, the data that `run_ranks` gets by address.
   type :: program_run_t
      type(program_t) :: program
      !> Exit status
      integer :: status = 0
   end type program_run_t

   abstract interface
      !> Estimate the memory that a scene needs.
      subroutine needs_interface(scene, threads, need)
         import :: memory_need_t, scene_t
         implicit none (type, external)
         type(scene_t), intent(in) :: scene
         !> Number of threads of a sweep; 0: as many as there are cores
         integer, intent(in) :: threads
         type(memory_need_t), intent(out) :: need
      end subroutine needs_interface

      !> Compute a scene, write its file, print its tables. Each of several MPI processes makes this call.
      subroutine run_interface(scene, job, error)
         import :: failure_t, job_t, scene_t
         implicit none (type, external)
         type(scene_t), intent(in) :: scene
         type(job_t), intent(in) :: job
         type(failure_t), allocatable, intent(out) :: error
      end subroutine run_interface
   end interface

contains

   !> Run a program in one process or in several MPI processes.
   subroutine run_program(program, status)
      type(program_t), intent(in) :: program
      !> Exit status: 0 done, 1 a run failed, 2 bad usage or input
      integer, intent(out) :: status

      type(program_run_t), target :: run

      run%program = program
      call prepare_process()
      call run_on_default_stack(run_ranks, c_loc(run))
      status = run%status
   end subroutine run_program

   !> Start and stop the MPI processes around a run of a program; called by `run_on_default_stack`.
   function run_ranks(data) bind(c) result(nothing)
      !> Address of a `program_run_t`
      type(c_ptr), value :: data
      type(c_ptr) :: nothing

      type(failure_t), allocatable :: error
      type(program_run_t), pointer :: run

      nothing = c_null_ptr
      call c_f_pointer(data, run)
      call single_threaded_blas()
      call start_ranks(error)
      if (allocated(error)) then
         call report(run%program, error, run%status)
         return
      end if
      call run_command_line(run%program, run%status)
      call stop_ranks()
   end function run_ranks

   !> Perform the requests of the command line.
   subroutine run_command_line(program, status)
      type(program_t), intent(in) :: program
      !> Exit status
      integer, intent(out) :: status

      type(argument_t), allocatable :: arguments(:)
      type(command_line_t) :: command
      type(scene_t), allocatable :: scenes(:)
      type(failure_t), allocatable :: error
      ! failure to print the help, which is ignored beside a failure of the arguments
      type(failure_t), allocatable :: unprinted
      character(:), allocatable :: problem
      integer :: i

      status = 0
      call get_arguments(arguments)
      call parse_arguments(arguments, command, error)
      if (allocated(command%format) .and. program%number /= program_motion) call fail(error, status_bad_input, &
         '--format: '//name_of_program(program%number)//' has no tables for other programs; its results file has all')
      if (allocated(error)) then
         ! without arguments the help is printed, too
         command%wants_help = size(arguments) == 0
         if (command%wants_help) call print_answers(program, command, unprinted)
      else if (command%wants_version .or. command%wants_help .or. allocated(command%names) &
         .or. allocated(command%template)) then
         call print_answers(program, command, error)
         if (.not. allocated(error)) return
      else
         call read_scenes(program%number, command%scenes, scenes, error)
         if (command%estimate .and. .not. allocated(error)) then
            scenes%mesh%estimate = .true.
            do i = 1, size(scenes)
               if (.not. scenes(i)%wants_response) call fail(error, status_bad_input, &
                  '--estimate: '//scenes(i)%file//' has no &response whose error could be estimated')
               problem = problem_with_damping(scenes(i))
               if (problem /= '') call complain_of_scene(scenes(i), 'damping', 'mode_ratios', problem, error)
            end do
         end if
         if (.not. allocated(error)) call check_memory_needs(program, scenes, command%threads, error)
      end if
      if (allocated(error)) then
         call report(program, error, status)
         return
      end if
      do i = 1, size(scenes)
         if (command%check_only) then
            call report_valid(scenes(i), command%quiet, error)
         else
            call run_scene(program, scenes(i), command%folder, command%threads, command%quiet, error, command%format)
         end if
         if (.not. allocated(error)) cycle
         call locate_failure(scenes(i), error)
         call report(program, error, status)
      end do
   end subroutine run_command_line

   !> Read and check all scenes before any of them runs.
   subroutine read_scenes(program, files, scenes, error)
      !> One of the `program_` constants; scenes of other programs are refused
      integer, intent(in) :: program
      !> Names of the files
      type(argument_t), intent(in) :: files(:)
      !> Scenes in the order of the files
      type(scene_t), allocatable, intent(out) :: scenes(:)
      !> Set by the first scene that is invalid or belongs to another program, or by two scenes of the same results file
      type(failure_t), allocatable, intent(out) :: error

      integer :: i, j

      allocate (scenes(size(files)))
      do i = 1, size(files)
         call read_scene(files(i)%text, scenes(i), error, program)
         if (.not. allocated(error)) call check_scene(scenes(i), error)
         if (allocated(error)) return
         do j = 1, i - 1
            if (scenes(j)%name == scenes(i)%name) then
               call fail(error, status_bad_input, files(i)%text//": &scene name = '"//scenes(i)%name// &
                  "': must differ from the other scenes' names, "//files(j)%text//' has it too')
               return
            end if
         end do
      end do
   end subroutine read_scenes

   !> Check that the memory suffices for each scene. MPI processes may see different free memory, so the first process
   !> decides.
   subroutine check_memory_needs(program, scenes, threads, error)
      type(program_t), intent(in) :: program
      type(scene_t), intent(in) :: scenes(:)
      !> Number of threads of a sweep; 0: as many as there are cores
      integer, intent(in) :: threads
      !> Set by the first scene that exceeds the memory
      type(failure_t), allocatable, intent(inout) :: error

      type(failure_t), allocatable :: refusal
      type(memory_need_t) :: need
      integer :: i

      do i = 1, size(scenes)
         if (.not. is_first_rank()) exit
         call program%memory_need_of(scenes(i), threads, need)
         call check_need(need, refusal)
         if (.not. allocated(refusal)) cycle
         call fail(error, refusal%status, scenes(i)%file//': '//refusal%message)
         exit
      end do
      if (max_of_ranks(merge(1, 0, allocated(error))) > 0) call fail(error, status_bad_input, 'a scene was refused')
   end subroutine check_memory_needs

   !> Compute a scene, write its results file and its tables for other programs, and print its tables.
   subroutine run_scene(program, scene, folder, threads, quiet, error, format)
      type(program_t), intent(in) :: program
      type(scene_t), intent(in) :: scene
      !> Folder of the results
      character(*), intent(in) :: folder
      !> Number of threads of a sweep; 0: as many as there are cores
      integer, intent(in) :: threads
      !> Whether to print no table
      logical, intent(in) :: quiet
      !> Set if the run fails, its files cannot be written or its tables cannot be printed
      type(failure_t), allocatable, intent(out) :: error
      !> Format of the tables for other programs, one of `table_formats`; absent: only existing tables are rewritten
      character(*), intent(in), optional :: format

      type(claim_t) :: claim
      type(job_t) :: job
      character(:), allocatable :: text
      ! part of the path of the folder that existed before
      character(:), allocatable :: existing
      ! maximum status of a failure in any of the MPI processes; 0: none has failed
      integer :: failure_status
      logical :: has_unit

      job%folder = folder
      job%threads = threads
      job%quiet = quiet
      job%label = name_of_program(program%number)//': '//scene%name
      call open_text(job%unit, error)
      has_unit = .not. allocated(error)
      existing = existing_part(folder)
      if (has_unit .and. is_first_rank()) call claim_results(folder, results_name(scene), claim, error)
      failure_status = 0
      if (allocated(error)) failure_status = error%status
      failure_status = max_of_ranks(failure_status)
      if (failure_status > 0) then
         ! the process that failed has the message already
         call fail(error, failure_status, '')
      else
         call program%run(scene, job, error)
      end if
      if (is_first_rank() .and. .not. allocated(error)) then
         call write_table_files(folder, results_name(scene), error, format)
      end if
      call release_results(claim)
      if (is_first_rank() .and. allocated(error)) call remove_empty_folders(folder, existing)
      if (has_unit) call text_of(job%unit, text, error)
      if (.not. allocated(error)) call print_text(text, error)
   end subroutine run_scene

   !> Print the version, help, names or template that the command line requests.
   subroutine print_answers(program, command, error)
      type(program_t), intent(in) :: program
      type(command_line_t), intent(in) :: command
      !> Reason why the text could not be printed
      type(failure_t), allocatable, intent(inout) :: error

      character, parameter :: line_end = new_line('a')
      character(:), allocatable :: names, text

      if (.not. is_first_rank()) return
      text = ''
      if (command%wants_version) text = text//name_of_program(program%number)//' '//program_version//line_end
      if (command%wants_help) text = text//usage(name_of_program(program%number), program%purpose, program%example)
      if (allocated(command%names)) then
         call write_names(program%number, command%names, command%wants_markdown, names, error)
         text = text//names
      end if
      if (allocated(command%template)) text = text//template_text(command%template)
      if (.not. allocated(error)) call print_text(text, error)
   end subroutine print_answers

   !> Print that a scene is valid.
   subroutine report_valid(scene, quiet, error)
      type(scene_t), intent(in) :: scene
      !> Whether to print nothing
      logical, intent(in) :: quiet
      !> Reason why the message could not be printed
      type(failure_t), allocatable, intent(inout) :: error

      character(:), allocatable :: words
      integer :: k

      if (quiet .or. .not. is_first_rank()) return
      words = failing_cases(scene)
      if (words /= '') words = ', but '//words
      words = scene%file//': good'//words//new_line('a')
      if (allocated(scene%warnings)) then
         do k = 1, size(scene%warnings)
            words = words//scene%file//': warning: '//trim(scene%warnings(k)%text)//new_line('a')
         end do
      end if
      call print_text(words, error)
   end subroutine report_valid

   !> Print a failure and update the exit status, which is the maximum status of all failures.
   subroutine report(program, error, status)
      type(program_t), intent(in) :: program
      type(failure_t), intent(in) :: error
      !> Exit status
      integer, intent(inout) :: status

      if (is_first_rank()) write (error_unit, '(a)') name_of_program(program%number)//': '//error%message
      status = max(status, error%status)
   end subroutine report

end module program_run
