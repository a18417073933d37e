!> Estimates of the mesh's error by running scenes on finer meshes.
module mesh_estimate
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use case_beam, only: case_beam_t, make_case_beam
   use failures, only: failure_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_table, peak_count
   use measure_rows, only: row_in
   use mesh_choice, only: find_beam
   use mesh_errors, only: judge, mesh_errors_t
   use motion_run, only: run_motion
   use response_types, only: response_t
   use run_measures, only: row_of
   use run_settings, only: output_settings_t, run_settings_t, strict_mode_tolerance
   use scene_beam_model, only: run_of
   use scene_types, only: scene_t
   use scene_units, only: units_in
   implicit none (type, external)
   private
   public :: estimate_cases, sample_of

   !> Of many cases so many are estimated.
   integer, parameter :: most_cases = 5

contains

   !> Numbers of the cases to estimate, evenly from the first to the last.
   pure function sample_of(cases) result(sample)
      !> How many there are
      integer, intent(in) :: cases
      integer, allocatable :: sample(:)

      integer :: count, i

      count = min(cases, most_cases)
      allocate (sample(count))
      sample = [(1 + nint(real(i, wp)*real(cases - 1, wp)/real(max(count - 1, 1), wp)), i=0, count - 1)]
   end function sample_of

   !> Run scenes on their mesh, and on meshes twice and four times as fine.
   subroutine estimate_cases(scenes, numbers, errors)
      !> The scenes as they run, [cases]
      type(scene_t), intent(in) :: scenes(:)
      !> Their numbers among all cases, [cases]
      integer, intent(in) :: numbers(:)
      type(mesh_errors_t), intent(out) :: errors

      type(case_beam_t) :: beam
      real(wp) :: rows(measure_count, 3), grading
      integer :: i, refinement

      associate (cases => size(scenes))
         allocate (errors%case, source=numbers)
         allocate (errors%elements(cases))
         allocate (errors%row(measure_count, cases), errors%error(measure_count, cases), &
            errors%order(measure_count, cases))
      end associate
      do i = 1, size(scenes)
         call find_beam(scenes(i), beam)
         errors%elements(i) = scenes(i)%mesh%elements
         grading = scenes(i)%mesh%ratio**(errors%elements(i) - 1)
         if (beam%check%compared > 0) then
            errors%elements(i) = beam%check%elements
            grading = beam%check%ratio**(beam%check%elements - 1)
         end if
         call measure(scenes(i), beam, rows(:, 1))
         do refinement = 1, 2
            associate (elements => 2**refinement*errors%elements(i))
               call make_case_beam(scenes(i), elements, grading**(1.0_wp/real(elements - 1, wp)), beam)
            end associate
            call measure(scenes(i), beam, rows(:, refinement + 1))
         end do
         errors%row(:, i) = rows(:, 1)
         call judge(rows(:, 1), rows(:, 2), rows(:, 3), measure_table%is_whole, errors%error(:, i), errors%order(:, i))
         errors%row(:, i) = row_in(units_in(scenes(i)), errors%row(:, i))
         errors%error(:, i) = row_in(units_in(scenes(i)), errors%error(:, i))
      end do
   end subroutine estimate_cases

   !> The measures of a run; NaN where it fails.
   subroutine measure(scene, beam, row)
      type(scene_t), intent(in) :: scene
      type(case_beam_t), intent(in) :: beam
      !> [measure_count]
      real(wp), intent(out) :: row(:)

      type(run_settings_t) :: settings
      type(response_t) :: response
      type(failure_t), allocatable :: error

      row = ieee_value(1.0_wp, ieee_quiet_nan)
      if (allocated(beam%trouble)) return
      settings = run_of(scene)
      settings%response%mode_tolerance = min(settings%response%mode_tolerance, strict_mode_tolerance)
      settings%output = output_settings_t(history=.false., measures=.true., most_peaks=peak_count)
      call run_motion(beam%model, settings, response, error, beam%modes)
      if (.not. allocated(error)) row = row_of(response%measures)
   end subroutine measure

end module mesh_estimate
