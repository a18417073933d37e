!> Results of a precision study (run time against error of all methods). An entry is one run with one set of settings.
!> A scheme is a method of integration with a mass matrix; the fastest run within an error bound is found for each
!> scheme, with errors that are differences from the motion that has converged in the mesh.
module precision_types
   use kinds, only: i8, wp
   use motion_errors, only: motion_errors_t
   use run_settings, only: name_length
   use scene_types, only: mass_consistent, integrator_exact, integrator_names, mass_names
   use timed_tasks, only: timing_t
   implicit none (type, external)
   private
   public :: motion_entry_t, timed_part_t, curve_t, solver_entry_t, check_t, saving_t, precision_t, beam_run_t, &
      varied_step, varied_hop, varied_modes, varied_mesh, varied_names, error_bounds, schemes_of, scheme_name, &
      fastest_of, error_contributions

   !> Setting by which an entry differs from its neighbours in the list.
   integer, parameter :: varied_step = 1
   integer, parameter :: varied_hop = 2
   integer, parameter :: varied_modes = 3
   integer, parameter :: varied_mesh = 4
   character(*), parameter :: varied_names(4) = [character(name_length) :: &
      'step', 'hop_tolerance', 'mode_tolerance', 'mesh_elements']

   !> Maximum length of the stored reason of a failure.
   integer, parameter :: failure_length = 256

   !> Run time and error of motion for one method with one set of settings.
   type :: motion_entry_t
      !> Method of integration: one of the `integrator_` constants
      integer :: integrator = 0
      !> Setting that is varied: one of the `varied_` constants
      integer :: varied = 0
      !> Newmark's step, or the interval of the compared samples of exact motion, tau
      real(wp) :: step = 0.0_wp
      !> Hop tolerance of exact motion, in eta
      real(wp) :: hop_tolerance = 0.0_wp
      !> Tolerance by which the number of modes of exact motion is chosen
      real(wp) :: mode_tolerance = 0.0_wp
      !> Number of elements
      integer :: elements = 0
      !> Mass matrix, one of the `mass_` constants
      integer :: mass = mass_consistent
      !> Time of a run of the assembled beam that records only events, s
      type(timing_t) :: run_time
      !> This time without the computation of modes, which several runs of one beam can use in common, s
      type(timing_t) :: motion_time
      !> Errors against the reference
      type(motion_errors_t) :: errors
      integer :: event_count = 0
      !> Number of modes in which exact motion was computed
      integer :: retained_modes = 0
      !> Number of steps, or of evaluations of modal sums
      integer(i8) :: evaluations = 0_i8
      !> Reason of a failure; empty: the run succeeded
      character(failure_length) :: failure = ''
   end type motion_entry_t

   !> Part of a run, and its run time.
   type :: timed_part_t
      character(name_length) :: name = ''
      type(timing_t) :: timing
   end type timed_part_t

   !> Growth of a quantity.
   type :: curve_t
      !> Name of the quantity that grows
      character(name_length) :: name = ''
      !> Name of the quantity on which it depends
      character(name_length) :: abscissa_name = ''
      !> Unit of the quantity that grows
      character(name_length) :: unit = ''
      real(wp), allocatable :: abscissa(:)
      real(wp), allocatable :: ordinate(:)
      !> Exponent of the fit ordinate ~ abscissa^exponent to the second half of the points
      real(wp) :: exponent = 0.0_wp
   end type curve_t

   !> Run time and error of one frequency solver on one mesh.
   type :: solver_entry_t
      !> Name of the solver
      character(name_length) :: solver = ''
      !> Number of elements of the mesh
      integer :: elements = 0
      !> Ratio of the lengths of neighbouring elements
      real(wp) :: ratio = 1.0_wp
      type(timing_t) :: timing
      !> |lambda/exact - 1| of the first mode; negative: not known
      real(wp) :: first_error = -1.0_wp
      !> Maximum of this error over all requested modes; negative: not known
      real(wp) :: largest_error = -1.0_wp
   end type solver_entry_t

   !> Check of the reference by Newmark's method with beta = 1/4, extrapolated from two steps to a vanishing step.
   type :: check_t
      !> The two steps, tau
      real(wp) :: steps(2) = 0.0_wp
      !> Difference of the run with the longer step from the extrapolation
      type(motion_errors_t) :: longer_step_difference
      !> Difference of the extrapolation from the reference
      type(motion_errors_t) :: difference
      !> Reason of a failure; empty: the check succeeded
      character(failure_length) :: failure = ''
   end type check_t

   !> Run time without and with a skip, the omission of a computation that a scene does not need.
   type :: saving_t
      !> Name of the computation that is skipped
      character(name_length) :: name = ''
      !> Time of the task without the skip, s
      type(timing_t) :: without
      !> Time of the task with the skip, s
      type(timing_t) :: with
      !> Maximum difference of the results with and without the skip; negative: no results are compared
      real(wp) :: difference = -1.0_wp
      !> Quantity that is compared
      character(name_length) :: compared = ''
   end type saving_t

   !> Run that represents the continuous beam, because its mesh is finer than all meshes compared, and its differences
   !> from other runs.
   type :: beam_run_t
      integer :: elements = 0
      !> Mass matrix, one of the `mass_` constants
      integer :: mass = mass_consistent
      !> Difference from the run on half as many elements
      type(motion_errors_t) :: half_mesh_difference
      !> Difference from the run with the other mass matrix, which is extrapolated if its error is of first order
      type(motion_errors_t) :: other_mass_difference
      !> Reason why the run with the other mass matrix failed; empty: the run succeeded
      character(failure_length) :: other_mass_failure = ''
      !> Estimated error of eta of this run, from the difference on half as many elements and an error of fourth order
      real(wp) :: uncertainty = 0.0_wp
   end type beam_run_t

   !> All results of a study. Lists that the scene does not request are unallocated.
   type :: precision_t
      !> Runs
      type(motion_entry_t), allocatable :: runs(:)
      !> Check of the reference with which the runs are compared
      type(check_t) :: check
      !> Run that represents the beam; unallocated: not requested
      type(beam_run_t), allocatable :: beam
      !> End of the comparison of histories, tau: the peak of the third rebound, or the end of the run
      real(wp) :: horizon = 0.0_wp
      type(timed_part_t), allocatable :: parts(:)
      type(curve_t), allocatable :: curves(:)
      type(solver_entry_t), allocatable :: solvers(:)
      type(saving_t), allocatable :: savings(:)
   end type precision_t

   !> Bounds of the maximum difference of eta from the converged motion of the beam.
   real(wp), parameter :: error_bounds(7) = [1.0e-2_wp, 1.0e-3_wp, 1.0e-4_wp, 1.0e-5_wp, 1.0e-6_wp, 1.0e-7_wp, &
      1.0e-8_wp]

contains


   !> Indices of the first entry of each scheme, among the entries that vary the mesh.
   pure function schemes_of(entries) result(schemes)
      type(motion_entry_t), intent(in) :: entries(:)
      !> Indices into `entries`, [schemes]
      integer, allocatable :: schemes(:)

      integer :: i

      allocate (schemes(0))
      do i = 1, size(entries)
         if (entries(i)%varied /= varied_mesh) cycle
         if (any(is_same_scheme(entries(schemes), entries(i)))) cycle
         schemes = [schemes, i]
      end do
   end function schemes_of

   !> Name of a scheme: method and mass matrix as in scene files.
   pure function scheme_name(entry) result(name)
      type(motion_entry_t), intent(in) :: entry
      character(40) :: name

      name = trim(integrator_names(entry%integrator))//', '//mass_names(entry%mass)
   end function scheme_name

   !> Index of the fastest entry of a scheme whose error is within a bound; 0: there is none. An entry does not qualify
   !> if an entry of the same scheme with at least as many elements and at most the same step exceeds the bound, because
   !> its small error would be due to errors that happen to cancel.
   pure integer function fastest_of(entries, scheme, bound) result(number)
      type(motion_entry_t), intent(in) :: entries(:)
      !> Any entry of the scheme
      type(motion_entry_t), intent(in) :: scheme
      !> Bound of the maximum difference of eta
      real(wp), intent(in) :: bound

      logical, dimension(size(entries)) :: is_of_scheme, exceeds_bound
      integer :: i

      is_of_scheme = is_same_scheme(entries, scheme) .and. entries%varied == varied_mesh .and. entries%failure == ''
      exceeds_bound = is_of_scheme .and. entries%errors%history > bound
      number = minloc(entries%run_time%median, dim=1, mask=is_of_scheme .and. [(.not. any(exceeds_bound .and. &
         entries%elements >= entries(i)%elements .and. entries%step <= entries(i)%step), i=1, size(entries))])
   end function fastest_of

   !> Contributions to the error of a run by Newmark's method, as maximum differences of eta, [3]: error of the time
   !> step (against exact motion on the same mesh), error of the mesh (of exact motion on this mesh), and both together.
   !> Negative: not known.
   pure function error_contributions(entries, number) result(contribution)
      type(motion_entry_t), intent(in) :: entries(:)
      !> Index of an entry that varies the step
      integer, intent(in) :: number
      real(wp) :: contribution(3)

      integer :: i

      contribution = -1.0_wp
      associate (stepped => entries(number))
         if (stepped%failure == '') contribution(1) = stepped%errors%history
         do i = 1, size(entries)
            if (entries(i)%varied /= varied_mesh .or. entries(i)%elements /= stepped%elements .or. &
               entries(i)%mass /= stepped%mass .or. entries(i)%failure /= '') cycle
            if (entries(i)%integrator == integrator_exact) contribution(2) = entries(i)%errors%history
            if (entries(i)%integrator /= stepped%integrator) cycle
            if (.not. abs(entries(i)%step - stepped%step) > 0.0_wp) contribution(3) = entries(i)%errors%history
         end do
      end associate
   end function error_contributions

   !> Whether two entries belong to the same scheme.
   elemental logical function is_same_scheme(one, other) result(answer)
      type(motion_entry_t), intent(in) :: one
      type(motion_entry_t), intent(in) :: other

      answer = one%integrator == other%integrator .and. one%mass == other%mass
   end function is_same_scheme

end module precision_types
