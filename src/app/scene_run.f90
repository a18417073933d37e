!> One scene from its file to its results.
module scene_run
   use beam_model, only: beam_model_t
   use case_runs, only: case_t, run_cases
   use cases_file, only: write_cases
   use cases_tables, only: print_cases
   use command_line, only: argument_t, program_version
   use console_tables, only: print_frequency_table, print_measures, print_model, print_modes
   use failures, only: fail, failure_t, status_bad_input
   use file_system, only: make_folder
   use frequency_study, only: frequency_table
   use frequency_types, only: frequency_table_t
   use motion_run, only: run_motion
   use paper_cases, only: make_ways, way_count, way_t
   use precision_file, only: write_precision
   use precision_study, only: run_precision
   use precision_tables, only: print_precision
   use precision_types, only: precision_t
   use process, only: open_text, print_text, text_of
   use progress_line, only: start_progress, stop_progress
   use response_types, only: response_t
   use results_claim, only: claim_results, claim_t, release_results
   use results_file, only: results_name, write_results
   use run_settings, only: run_settings_t
   use scene_beam_model, only: model_of, run_of
   use scene_checks, only: check_scene
   use scene_reader, only: read_scene
   use run_settings, only: run_settings_t
   use scene_types, only: scene_t
   use statements_file, only: check_text, write_statements
   use statements_study, only: judge_statements, study_t
   use statements_tables, only: print_statements
   use sweep_ranks, only: agree, is_first_rank
   use sweep_study, only: run_sweep
   implicit none (type, external)
   private
   public :: read_scenes, run_scene, compute_scene

contains

   !> Read and check all scenes before any of them runs.
   subroutine read_scenes(files, scenes, error)
      !> Names of the files
      type(argument_t), intent(in) :: files(:)
      !> The scenes
      type(scene_t), allocatable, intent(out) :: scenes(:)
      !> Set by the first scene that is wrong, or by two that would share a results file
      type(failure_t), allocatable, intent(out) :: error

      integer :: i, j

      allocate (scenes(size(files)))
      do i = 1, size(files)
         call read_scene(files(i)%text, scenes(i), error)
         if (.not. allocated(error)) call check_scene(scenes(i), error)
         if (allocated(error)) return
         do j = 1, i - 1
            if (scenes(j)%name == scenes(i)%name) then
               call fail(error, status_bad_input, files(i)%text//': &scene name = '''//scenes(i)%name// &
                         ''': must differ from the other scenes'' names, '//files(j)%text//' has it too')
               return
            end if
         end do
      end do
   end subroutine read_scenes

   !> Compute what a scene asks for.
   subroutine compute_scene(scene, model, table, response, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its beam; left empty where only a table of frequencies over other meshes is asked for
      type(beam_model_t), intent(out) :: model
      !> Frequencies, if asked for
      type(frequency_table_t), allocatable, intent(out) :: table
      !> Motion, if asked for
      type(response_t), allocatable, intent(out) :: response
      !> Set when the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(run_settings_t) :: settings

      if (scene%wants_frequencies) then
         allocate (table)
         call frequency_table(scene, table, error)
         if (allocated(error)) return
      end if
      if (.not. scene%wants_response) return
      call model_of(scene, scene%mesh%elements, scene%mesh%ratio, model, error)
      if (allocated(error)) return
      allocate (response)
      settings = run_of(scene)
      settings%output%measures = .true.
      call run_motion(model, settings, response, error)
   end subroutine compute_scene

   !> Compute a scene, write its file, print its table.
   subroutine run_scene(scene, folder, threads, quiet, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Folder of the results
      character(*), intent(in) :: folder
      !> Threads of a sweep; 0: as many as there are cores
      integer, intent(in) :: threads
      !> No table
      logical, intent(in) :: quiet
      !> Set when the run fails, its file cannot be written or its table not be printed
      type(failure_t), allocatable, intent(out) :: error

      type(claim_t) :: claim
      character(:), allocatable :: text
      integer :: unit, trouble
      logical :: has_unit

      call open_text(unit, error)
      has_unit = .not. allocated(error)
      ! what cannot be written is better known before a long run than after it
      if (has_unit .and. is_first_rank()) then
         call make_folder(folder, error)
         if (.not. allocated(error)) call claim_results(folder, results_name(scene), claim, error)
      end if
      trouble = 0
      if (allocated(error)) trouble = error%status
      trouble = agree(trouble)
      if (trouble > 0) then
         call fail(error, trouble, '')
      else if (scene%wants_sweep) then
         call run_sweep(scene, folder, program_version, threads, quiet, unit, error)
      else if (is_first_rank()) then
         ! what processes cannot share the first one does
         call run_alone(scene, folder, quiet, unit, error)
      end if
      call release_results(claim)
      if (has_unit) call text_of(unit, text, error)
      if (.not. allocated(error)) call print_text(text, error)
   end subroutine run_scene

   !> Do what is no sweep.
   subroutine run_alone(scene, folder, quiet, unit, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Folder of the results
      character(*), intent(in) :: folder
      !> No table
      logical, intent(in) :: quiet
      !> Where the table goes
      integer, intent(in) :: unit
      !> Set when the run fails or its file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: model
      type(frequency_table_t), allocatable :: table
      type(response_t), allocatable :: response

      if (scene%wants_precision) then
         call run_precision_scene(scene, folder, quiet, unit, error)
         return
      end if
      if (scene%wants_statements) then
         call run_statements_scene(scene, folder, quiet, unit, error)
         return
      end if
      if (scene%wants_cases) then
         call run_cases_of_scene(scene, folder, quiet, unit, error)
         return
      end if
      if (.not. quiet) call start_progress('impactbeam: '//scene%name)
      call compute_scene(scene, model, table, response, error)
      call stop_progress()
      if (allocated(error)) return
      ! what is not allocated is not present
      if (allocated(model%mesh%position)) then
         call write_results(folder, program_version, scene, error, model%mesh%position, table, response)
      else
         call write_results(folder, program_version, scene, error, frequencies=table)
      end if
      if (allocated(error) .or. quiet) return
      call print_model(unit, scene)
      if (allocated(response)) call print_modes(unit, response%mode_check)
      if (allocated(table)) call print_frequency_table(unit, table)
      if (allocated(response)) call print_measures(unit, response%measures)
   end subroutine run_alone

   !> Run the cases, write the file, print the table.
   subroutine run_cases_of_scene(scene, folder, quiet, unit, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Folder of the results
      character(*), intent(in) :: folder
      !> No table
      logical, intent(in) :: quiet
      !> Where the table goes
      integer, intent(in) :: unit
      !> Set when a run fails or the file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(case_t), allocatable :: cases(:)

      if (.not. quiet) call start_progress('impactbeam: '//scene%name)
      call run_cases(scene, cases, error)
      call stop_progress()
      if (allocated(error)) return
      call write_cases(folder, program_version, scene, cases, error)
      if (allocated(error) .or. quiet) return
      call print_model(unit, cases(1)%scene)
      call print_cases(unit, scene, cases)
   end subroutine run_cases_of_scene

   !> Compare run time and error, write the file, print the tables.
   subroutine run_precision_scene(scene, folder, quiet, unit, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Folder of the results
      character(*), intent(in) :: folder
      !> No table
      logical, intent(in) :: quiet
      !> Where the table goes
      integer, intent(in) :: unit
      !> Set when the study fails or its file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(precision_t) :: study

      if (.not. quiet) call start_progress('impactbeam: '//scene%name)
      call run_precision(scene, folder, study, error)
      call stop_progress()
      if (allocated(error)) return
      call write_precision(folder, program_version, scene, study, error)
      if (allocated(error) .or. quiet) return
      call print_precision(unit, scene, study)
   end subroutine run_precision_scene

   !> Judge the paper's statements, write the files, print the table.
   subroutine run_statements_scene(scene, folder, quiet, unit, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Folder of the results
      character(*), intent(in) :: folder
      !> No table
      logical, intent(in) :: quiet
      !> Where the table goes
      integer, intent(in) :: unit
      !> Set when a run fails or a file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(study_t) :: study
      type(way_t) :: ways(way_count)

      call check_text(folder, scene, error)
      if (allocated(error)) return
      if (.not. quiet) call start_progress('impactbeam: '//scene%name)
      call make_ways(scene%statements%elements, scene%statements%fine_elements, ways)
      call judge_statements(ways, scene%statements%duration, study, error)
      call stop_progress()
      if (allocated(error)) return
      call write_statements(folder, program_version, scene, study, error)
      if (allocated(error) .or. quiet) return
      call print_statements(unit, study)
   end subroutine run_statements_scene

end module scene_run
