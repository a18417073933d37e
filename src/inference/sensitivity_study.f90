!> The study of a scene with &sensitivity: derivatives of measures follow from runs with each parameter at steps above
!> and below its value, which are the cases of a sweep plan.
module sensitivity_study
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_c_binding, only: c_size_t
   use difference_derivatives, only: differentiate
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use measure_list, only: measure_named, measure_status
   use measure_selection, only: chosen_measures
   use quantities, only: quantity_named, units_t
   use quantity_groups, only: quantity_group_t
   use results_file, only: begin_results, finish_results
   use scene_types, only: scene_t
   use scene_units, only: units_in
   use sensitivity_results, only: print_sensitivity, sensitivity_t, write_sensitivity
   use study_job, only: job_t
   use sweep_chunks, only: chunk_rows_t, load_chunks, remove_chunk_folder
   use sweep_plan, only: plan_t
   use sweep_ranks, only: is_first_rank
   use sweep_settings, only: parameter_t
   use sweep_study, only: plan_run_t, run_plan
   implicit none (type, external)
   private
   public :: run_sensitivity, plan_steps, find_sensitivity

contains

   !> Run the cases, write the results file, print the tables.
   subroutine run_sensitivity(scene, job, error)
      !> Scene with &sensitivity
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if there are no results
      type(failure_t), allocatable, intent(out) :: error

      ! estimated size of the file
      integer(c_size_t), parameter :: expected_bytes = 100000_c_size_t
      type(plan_t) :: plan
      type(plan_run_t) :: run
      type(sensitivity_t) :: sensitivity
      type(quantity_group_t) :: root
      type(chunk_rows_t) :: cases

      call plan_steps(scene, plan)
      call run_plan(scene, plan, job, run, error)
      if (allocated(error) .or. .not. is_first_rank()) return
      call load_chunks(plan, cases, error)
      if (allocated(error)) return
      if (cases%rows(measure_status, 1) > 0.0_wp) then
         call remove_chunk_folder(plan%path)
         call fail(error, status_run_failed, trim(cases%reasons(1)))
         return
      end if
      call find_sensitivity(scene, cases%rows, sensitivity)
      call begin_results(root, expected_bytes, scene)
      call write_sensitivity(root%subgroup('sensitivity'), scene, sensitivity)
      call finish_results(root, job%folder, scene, error)
      if (allocated(error)) return
      call remove_chunk_folder(plan%path)
      if (.not. job%quiet) call print_sensitivity(job%unit, scene, sensitivity)
   end subroutine run_sensitivity

   !> Plan the cases: the scene itself, then for each parameter and step one case above and one below its value.
   subroutine plan_steps(scene, plan)
      !> Scene with &sensitivity
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(out) :: plan

      ! number of cases in a chunk, so small that all threads have work
      integer, parameter :: cases_together = 8
      real(wp) :: step(size(scene%sensitivity%parameters))
      integer :: case, i, k, side

      associate (settings => scene%sensitivity)
         plan%cases = 1 + 2*settings%steps*size(settings%parameters)
         plan%chunk_cases = cases_together
         plan%chunks = (plan%cases - 1)/cases_together + 1
         step = first_steps(scene)
         allocate (plan%axes(size(settings%parameters)))
         do k = 1, size(plan%axes)
            plan%axes(k)%parameter = settings%parameters(k)
            allocate (plan%axes(k)%values(plan%cases), source=settings%values(k))
         end do
         case = 1
         do k = 1, size(plan%axes)
            do i = 1, settings%steps
               do side = 1, 2
                  case = case + 1
                  associate (value => settings%values(k) + merge(1.0_wp, -1.0_wp, side == 1)*scale(step(k), 1 - i))
                     ! a case beyond a limit is run with the value of the scene and not used
                     if (is_allowed(settings%parameters(k), value)) plan%axes(k)%values(case) = value
                  end associate
               end do
            end do
            plan%axes(k)%minimum = minval(plan%axes(k)%values)
            plan%axes(k)%maximum = maxval(plan%axes(k)%values)
         end do
      end associate
   end subroutine plan_steps

   !> First step of each parameter: a fraction of its value or, if the value is 0, the same fraction of the scale of its
   !> quantity (1 for a dimensionless parameter).
   pure function first_steps(scene) result(step)
      !> Scene with &sensitivity
      type(scene_t), intent(in) :: scene
      real(wp) :: step(size(scene%sensitivity%parameters))

      type(units_t) :: units
      integer :: k

      units = units_in(scene)
      associate (settings => scene%sensitivity)
         do k = 1, size(step)
            step(k) = settings%step*abs(settings%values(k))
            if (step(k) > 0.0_wp) cycle
            step(k) = settings%step
            if (settings%parameters(k)%quantity /= '') then
               step(k) = settings%step*units%factor(quantity_named(settings%parameters(k)%quantity))
            end if
         end do
      end associate
   end function first_steps

   !> Find the derivatives from the measures of all cases.
   subroutine find_sensitivity(scene, rows, sensitivity)
      !> Scene with &sensitivity
      type(scene_t), intent(in) :: scene
      !> Measures, [measure_count, cases], in the order of the plan
      real(wp), intent(in) :: rows(:, :)
      type(sensitivity_t), intent(out) :: sensitivity

      integer, allocatable :: above(:), below(:)
      real(wp) :: nan, step(size(scene%sensitivity%parameters))
      logical, dimension(scene%sensitivity%steps) :: reaches_above, reaches_below
      integer :: first, i, k

      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      step = first_steps(scene)
      sensitivity%measures = chosen_measures(scene, scene%sensitivity%measures)
      ! if the scene names no measures, all measures that have a value
      if (.not. allocated(scene%sensitivity%measures)) sensitivity%measures = pack(sensitivity%measures, &
         .not. ieee_is_nan(rows(sensitivity%measures, 1)))
      sensitivity%measured = rows(sensitivity%measures, 1)
      associate (settings => scene%sensitivity, measures => sensitivity%measures)
         allocate (sensitivity%derivative(size(step), size(measures)), sensitivity%impacts_change(size(step)), &
            sensitivity%is_at_limit(size(step)))
         do k = 1, size(step)
            ! the order of `plan_steps`: case 1 is the scene; then, for each parameter and step, a case above and one
            ! below
            first = 2 + 2*settings%steps*(k - 1)
            above = [(first + 2*(i - 1), i=1, settings%steps)]
            below = above + 1
            associate (parameter => settings%parameters(k), value => settings%values(k), &
               steps => [(scale(step(k), 1 - i), i=1, settings%steps)])
               reaches_above = is_allowed(parameter, value + steps)
               reaches_below = is_allowed(parameter, value - steps)
               do i = 1, size(measures)
                  sensitivity%derivative(k, i) = differentiate(step(k), rows(measures(i), 1), &
                     merge(rows(measures(i), above), nan, reaches_above), &
                     merge(rows(measures(i), below), nan, reaches_below))
               end do
               sensitivity%is_at_limit(k) = .not. (any(reaches_above) .and. any(reaches_below))
            end associate
            associate (impacts => rows(measure_named('impacts'), :), &
               nearest => [above(size(above)), below(size(below))])
               sensitivity%impacts_change(k) = nint(impacts(nearest(1)) - impacts(nearest(2)))
               ! a failed case has no number of impacts
               if (any(rows(measure_status, nearest) > 0.0_wp)) sensitivity%impacts_change(k) = 0
            end associate
         end do
      end associate

   end subroutine find_sensitivity

   !> Whether scenes may give a value of a parameter.
   elemental logical function is_allowed(parameter, value)
      type(parameter_t), intent(in) :: parameter
      real(wp), intent(in) :: value

      is_allowed = value >= parameter%allowed(1) .and. value <= parameter%allowed(2)
   end function is_allowed

end module sensitivity_study
