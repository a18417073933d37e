!> The study of one scene without &sweep and &cases: its table of frequencies, one run, and the analyses of the run.
module single_study
   use analyses, only: analyse, analysed_t, print_analyses, write_analyses
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use frequency_results, only: print_frequency_table
   use frequency_study, only: frequency_table
   use frequency_types, only: frequency_table_t
   use kinds, only: wp
   use mesh_choice, only: case_beam_t, choose_mesh
   use mesh_errors, only: mesh_errors_t, print_mesh_errors, write_mesh_errors
   use mesh_estimates, only: estimate_cases, estimate_if_cheap
   use motion_run, only: run_motion
   use progress_line, only: start_progress, stop_progress
   use quantities, only: units_in
   use quantity_groups, only: quantity_group_t
   use response_types, only: response_t
   use results_file, only: begin_results, expected_size, finish_results, write_groups
   use run_progress, only: disable_progress, enable_progress
   use run_settings, only: method_newmark, run_settings_t
   use run_tables, only: print_contacts, print_driven, print_measures, print_mesh, print_modes, print_statistics, &
      print_stresses
   use run_warnings, only: warn_of_run
   use scene_beam_model, only: load_period_of, model_of, run_settings_of, varies_at_end
   use scene_types, only: scene_t
   use scene_words, only: print_model, stop_of_release
   use study_job, only: job_t
   use table_columns, only: print_line
   implicit none (type, external)
   private
   public :: run_single, compute_scene

contains

   !> Compute the results of a scene, write the results file, print the tables.
   subroutine run_single(scene, job, error)
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if the run fails or the file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: model
      type(frequency_table_t), allocatable :: table
      type(response_t), allocatable :: response
      type(mesh_errors_t), allocatable :: errors
      type(analysed_t), allocatable :: analysed(:)
      type(quantity_group_t) :: root
      ! the scene with warnings about its run
      type(scene_t), allocatable :: scene_with_warnings
      ! period of the loads, tau; 0: the run is not driven
      real(wp) :: load_period

      if (.not. job%quiet) call start_progress(job%label)
      call compute_scene(scene, model, table, response, analysed, error)
      if (allocated(response) .and. .not. allocated(error)) then
         if (scene%mesh%estimate) then
            allocate (errors)
            ! the run counts as case 1
            call estimate_cases([scene], [1], errors)
         else if (scene%mesh%estimates_if_cheap) then
            call estimate_if_cheap(scene, response, errors)
         end if
      end if
      call stop_progress()
      if (allocated(error)) return
      ! results that are not allocated count as absent arguments
      call begin_results(root, expected_size(response), scene)
      call write_groups(root, model%mesh%position, table, response, model%section)
      call write_analyses(root, analysed)
      if (allocated(errors)) call write_mesh_errors(root%subgroup('mesh_estimate'), errors)
      call finish_results(root, job%folder, scene, error)
      if (allocated(error) .or. job%quiet) return
      allocate (scene_with_warnings, source=scene)
      if (allocated(response)) call warn_of_run(scene_with_warnings, response)
      call print_model(job%unit, scene_with_warnings, model%mesh%position)
      if (allocated(response)) call print_mesh(job%unit, response%mesh_check, units_in(scene))
      if (allocated(response)) call print_modes(job%unit, response%mode_check, units_in(scene), &
         scene%response%method == method_newmark)
      if (allocated(table)) call print_frequency_table(job%unit, table, units_in(scene))
      if (allocated(response)) then
         load_period = load_period_of(scene)
         ! with several stops, the measures printed are those of the stop from which the beam is released
         call print_measures(job%unit, response%measures, units_in(scene), stop_of_release(scene), &
            varies_at_end(scene), allocated(response%statistics), scene%has_contacts(), errors)
         if (load_period > 0.0_wp .and. (scene%has_contacts() .or. allocated(response%statistics))) then
            call print_driven(job%unit, response%statistics, load_period, units_in(scene))
         end if
         if (scene%has_contacts()) then
            if (scene%mesh%estimates_if_cheap .and. .not. allocated(errors)) call print_line(job%unit, 'mesh error', &
               'not estimated, as that would take long: --estimate does')
            if (allocated(response%contacts)) call print_contacts(job%unit, response%contacts, units_in(scene))
            if (allocated(response%statistics)) call print_statistics(job%unit, response%statistics, &
               response%contacts, units_in(scene), load_period)
         end if
         ! the measures have only the maximum of all positions
         if (allocated(response%moments)) then
            if (size(response%moments) > 1) call print_stresses(job%unit, response%moments, units_in(scene), &
               allocated(response%statistics), response%moment_windows)
         end if
      end if
      call print_analyses(job%unit, analysed, units_in(scene))
      if (scene%mesh%estimate .and. allocated(errors)) call print_mesh_errors(job%unit, errors, units_in(scene))
   end subroutine run_single

   !> Compute the results of a scene. From `enable_progress` to `disable_progress`, the run reports the time that it has
   !> reached to the progress line of `run_single`.
   subroutine compute_scene(scene, model, table, response, analysed, error)
      type(scene_t), intent(in) :: scene
      !> The beam; empty if only a table of frequencies is requested
      type(beam_model_t), intent(out) :: model
      !> Table of frequencies, if requested
      type(frequency_table_t), allocatable, intent(out) :: table
      !> Response, if requested
      type(response_t), allocatable, intent(out) :: response
      !> Analyses of the run or of the beam with their results; empty if none is requested
      type(analysed_t), allocatable, intent(out) :: analysed(:)
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(case_beam_t) :: beam
      type(run_settings_t) :: settings
      logical :: draws_start
      ! whether the mesh is found by runs
      logical :: finds_mesh

      finds_mesh = scene%wants_response .and. (scene%mesh%tolerance > 0.0_wp .or. scene%mesh%found%finer_elements > 0)
      if (finds_mesh) call choose_mesh(scene, beam)
      if (allocated(beam%error)) error = beam%error
      if (allocated(error)) return
      if (scene%wants_frequencies) then
         allocate (table)
         call frequency_table(scene, table, error, beam%check)
         if (allocated(error)) return
      end if
      allocate (analysed(0))
      if (.not. scene%wants_response) return
      allocate (response)
      settings = run_settings_of(scene)
      settings%output%measures = .true.
      ! pictures of the scene show the shape at the start
      draws_start = .not. allocated(settings%output%shape_times) .and. settings%output%shape_step <= 0.0_wp
      if (draws_start) settings%output%shape_times = [0.0_wp]
      if (finds_mesh) then
         model = beam%model
         call enable_progress()
         call run_motion(model, settings, response, error, beam%modes)
         response%mesh_check = beam%check
      else
         call model_of(scene, scene%mesh%elements, scene%mesh%ratio, model, error, moves=.true.)
         if (allocated(error)) return
         call enable_progress()
         call run_motion(model, settings, response, error)
      end if
      call disable_progress()
      if (draws_start .and. allocated(response%shape_velocity)) then
         deallocate (response%shape_velocity, response%shape_slope_velocity)
      end if
      if (.not. allocated(error)) call analyse(scene, model, settings, response, analysed, error)
   end subroutine compute_scene

end module single_study
