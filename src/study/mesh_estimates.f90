!> Estimates the discretisation error of the measures of runs, from runs on the mesh and on two finer meshes. What the
!> modes that a run leaves out change, and what Newmark's steps change, are parts of this error.
module mesh_estimates
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use measure_list, only: measure_count, measure_table, peak_count
   use measure_rows, only: row_in_units
   use mesh_choice, only: cheap_work, choose_mesh, run_on_mesh, run_trial, trial_t, work_of
   use mesh_errors, only: estimate_mesh_error, mesh_errors_t
   use quantities, only: units_in
   use response_types, only: response_t
   use run_measures, only: row_of
   use run_settings, only: method_exact, output_settings_t, run_settings_t, strict_mode_tolerance
   use scene_beam_model, only: run_settings_of
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: estimate_cases, estimate_if_cheap, sample_cases

   !> Maximum number of cases whose errors are estimated.
   integer, parameter :: max_cases = 5

contains

   !> Numbers of the cases whose errors are estimated, evenly spaced from the first to the last.
   pure function sample_cases(cases) result(sample)
      !> Number of cases
      integer, intent(in) :: cases
      integer, allocatable :: sample(:)

      integer :: count, i

      count = min(cases, max_cases)
      sample = [(1 + nint(real(i, wp)*real(cases - 1, wp)/real(max(count - 1, 1), wp)), i=0, count - 1)]
   end function sample_cases

   !> Estimate the errors of the measures of a single run if the estimate takes hardly any time.
   subroutine estimate_if_cheap(scene, response, errors)
      type(scene_t), intent(in) :: scene
      !> The run
      type(response_t), intent(in) :: response
      !> Unallocated: the estimate would take too long
      type(mesh_errors_t), allocatable, intent(out) :: errors

      ! work of the runs of the estimate over that of the run: they have 1, 2 and 4 times as many modes
      real(wp), parameter :: factor = 7.0_wp
      logical :: is_cut

      if (factor*work_of(response, settings_of_estimate(scene)) > cheap_work) return
      allocate (errors)
      call estimate_cases([scene], [1], errors, cheap_work, is_cut)
      if (is_cut) deallocate (errors)
   end subroutine estimate_if_cheap

   !> Estimate the errors of measures by extrapolation from runs on the mesh of each scene and on meshes with two and
   !> four times as many elements. These runs are exact motion and leave out hardly any modes; the difference between
   !> the first of them and the run itself is added to the error. (Newmark's steps would find an event at the same
   !> fraction of a step on all meshes.) A number of modes that the scene gives holds for all runs.
   subroutine estimate_cases(scenes, numbers, errors, max_work, is_cut)
      !> Scenes with the parameters of their cases, [cases]
      type(scene_t), intent(in) :: scenes(:)
      !> Numbers of the cases, [cases]
      integer, intent(in) :: numbers(:)
      type(mesh_errors_t), intent(out) :: errors
      !> Work that the runs may take (see `mesh_choice`); absent: any
      real(wp), intent(in), optional :: max_work
      !> Whether the estimate is incomplete, because the runs would take more than `max_work`
      logical, intent(out), optional :: is_cut

      ! allocated, because the type is large and stacks of threads are small
      type(trial_t), allocatable :: trial
      type(run_settings_t) :: settings
      ! measures on the three meshes, and of the run itself
      real(wp) :: rows(measure_count, 3), row(measure_count)
      ! grading of all three meshes: ratio of the longest to the shortest element
      real(wp) :: grading
      real(wp) :: last_work, work
      integer :: i, refinement

      allocate (errors%case, source=numbers)
      allocate (errors%elements(size(scenes)))
      allocate (errors%row(measure_count, size(scenes)))
      allocate (errors%error, errors%order, mold=errors%row)
      do i = 1, size(scenes)
         settings = settings_of_estimate(scenes(i))
         allocate (trial)
         call choose_mesh(scenes(i), trial%beam)
         errors%elements(i) = scenes(i)%mesh%elements
         grading = scenes(i)%mesh%ratio**(errors%elements(i) - 1)
         if (trial%beam%check%finer_elements > 0) then
            errors%elements(i) = trial%beam%check%elements
            grading = trial%beam%check%ratio**(trial%beam%check%elements - 1)
         end if
         call run_trial(settings, trial)
         call record_row(row)
         settings%response%mode_tolerance = min(settings%response%mode_tolerance, strict_mode_tolerance)
         if (settings%response%method /= method_exact) then
            settings%response%method = method_exact
            call run_on_mesh(scenes(i), settings, errors%elements(i), grading, trial)
         else if (trial%response%mode_check%retained < trial%response%mode_check%all_modes) then
            call run_trial(settings, trial)
         end if
         call record_row(rows(:, 1))
         work = 0.0_wp
         do refinement = 1, 2
            last_work = work_of(trial%response, settings, trial%response%mode_check%retained)
            work = work + last_work
            ! twice as many elements have twice as many modes, and their motion often more events: three times the work
            if (present(max_work)) then
               is_cut = work + 3.0_wp*last_work > max_work
               if (is_cut) return
            end if
            call run_on_mesh(scenes(i), settings, 2**refinement*errors%elements(i), grading, trial)
            call record_row(rows(:, refinement + 1))
         end do
         deallocate (trial)
         call estimate_mesh_error(rows(:, 1), rows(:, 2), rows(:, 3), measure_table%is_whole, errors%error(:, i), &
            errors%order(:, i))
         errors%row(:, i) = row_in_units(units_in(scenes(i)), row)
         errors%error(:, i) = row_in_units(units_in(scenes(i)), errors%error(:, i) + abs(row - rows(:, 1)))
      end do

   contains

      !> The measures of the trial; NaN if the run failed.
      subroutine record_row(measures)
         real(wp), intent(out) :: measures(:)

         measures = ieee_value(1.0_wp, ieee_quiet_nan)
         if (.not. allocated(trial%error)) measures = row_of(trial%response%measures)
      end subroutine record_row

   end subroutine estimate_cases

   !> Settings of the runs of an estimate: those of the scene, without what no measure needs.
   pure type(run_settings_t) function settings_of_estimate(scene) result(settings)
      type(scene_t), intent(in) :: scene

      settings = run_settings_of(scene)
      settings%output = output_settings_t(history=.false., measures=.true., max_peaks=peak_count)
      if (allocated(settings%stress)) settings%stress%history = .false.
      ! the measures are statistics over all blocks together
      if (allocated(settings%statistics)) settings%statistics%blocks = 1
      ! measures of analyses are not estimated
      if (allocated(settings%spectrum)) deallocate (settings%spectrum)
   end function settings_of_estimate

end module mesh_estimates
