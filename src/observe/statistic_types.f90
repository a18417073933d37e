!> Types of the statistics of a run: integrals over time, sums over impacts and extremes, all called sums here and
!> accumulated in equal blocks of time, and the statistics that follow from them at the end of the run, as quotients and
!> extremes of sums. The scatter of the blocks gives confidence intervals (docs/theory.md, section 20).
module statistic_types
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use measure_list, only: first_statistic, measure_count, measure_named
   use signal_peaks, only: extreme_search_t, peak_tolerance
   implicit none (type, external)
   private
   public :: run_statistics_t, block_sums_t, impact_t, contact_sums_t, statistic_count, sum_time, sum_contact, &
      sum_force, sum_square_force, sum_impulse, sum_impacts, sum_velocity, sum_impact_impulse, sum_displacement, &
      sum_square_displacement, sum_tip, sum_square_tip, maximum_force, maximum_velocity, maximum_impulse, &
      minimum_displacement, maximum_displacement, minimum_tip, maximum_tip, sum_count, minimum_force, sum_work, &
      sum_square_acceleration, sum_square_tip_acceleration, minimum_acceleration, maximum_acceleration, &
      minimum_tip_acceleration, maximum_tip_acceleration, forms, minima, find_statistics

   !> Number of statistics of a run; they are the last entries of the list of measures
   integer, parameter :: statistic_count = measure_count - first_statistic + 1

   ! The following constants are the indices of the sums of a contact (integrals, counts and extremes).

   !> Length of the block
   integer, parameter :: sum_time = 1
   !> Time in contact
   integer, parameter :: sum_contact = 2
   !> Integral of the force over time
   integer, parameter :: sum_force = 3
   !> Integral of the square of the force over time
   integer, parameter :: sum_square_force = 4
   !> Integral of the force over time plus all impulses, also of captures and on closed contacts
   integer, parameter :: sum_impulse = 5
   !> Number of impacts
   integer, parameter :: sum_impacts = 6
   !> Sum of the velocities of impacts
   integer, parameter :: sum_velocity = 7
   !> Sum of the impulses of the impacts that count; the integral of the force during each is included
   integer, parameter :: sum_impact_impulse = 8
   !> Integral of the displacement at the contact over time
   integer, parameter :: sum_displacement = 9
   !> Integral of the square of the displacement at the contact over time
   integer, parameter :: sum_square_displacement = 10
   !> Integral of the displacement of the tip over time
   integer, parameter :: sum_tip = 11
   !> Integral of the square of the displacement of the tip over time
   integer, parameter :: sum_square_tip = 12
   !> Minimum of the force, stored among the sums like the other extremes
   integer, parameter :: minimum_force = 13
   !> Maximum of the force
   integer, parameter :: maximum_force = 14
   !> Maximum of the velocities of impacts
   integer, parameter :: maximum_velocity = 15
   !> Maximum of the impulses of impacts
   integer, parameter :: maximum_impulse = 16
   !> Minimum of the displacement at the contact
   integer, parameter :: minimum_displacement = 17
   !> Maximum of the displacement at the contact
   integer, parameter :: maximum_displacement = 18
   !> Minimum of the displacement of the tip
   integer, parameter :: minimum_tip = 19
   !> Maximum of the displacement of the tip
   integer, parameter :: maximum_tip = 20
   !> Energy dissipated at the contact, by dampers and at impacts
   integer, parameter :: sum_work = 21
   !> Integral of the square of the acceleration at the contact over time
   integer, parameter :: sum_square_acceleration = 22
   !> Integral of the square of the acceleration of the tip over time
   integer, parameter :: sum_square_tip_acceleration = 23
   !> Minimum of the acceleration at the contact
   integer, parameter :: minimum_acceleration = 24
   !> Maximum of the acceleration at the contact
   integer, parameter :: maximum_acceleration = 25
   !> Minimum of the acceleration of the tip
   integer, parameter :: minimum_tip_acceleration = 26
   !> Maximum of the acceleration of the tip
   integer, parameter :: maximum_tip_acceleration = 27
   !> Number of sums
   integer, parameter :: sum_count = 27

   !> An impact: a contact, together with further contacts that follow after too short a pause or too low a flight to
   !> count as separate impacts.
   type :: impact_t
      !> Beginning of the impact, tau
      real(wp) :: tau = 0.0_wp
      !> End of the impact, tau, from which the pause to the next impact counts
      real(wp) :: until = 0.0_wp
      !> Velocity towards the stop at the beginning
      real(wp) :: velocity = 0.0_wp
      !> Integral of forces plus impulses, as far as they lie within the blocks
      real(wp) :: impulse = 0.0_wp
      !> Maximum force
      real(wp) :: force = 0.0_wp
      !> Whether the impact counts in the statistics: it begins within the blocks and during the run (not with a contact
      !> that is closed at the start), with a velocity towards the stop; at the end of the run also: its force reaches
      !> `threshold`
      logical :: counts = .false.
   end type impact_t

   !> Sums and impacts of one contact.
   type :: contact_sums_t
      !> Whether the force of the contact is finite (the stop is compliant), so that the integral of the squared force
      !> exists
      logical :: has_finite_force = .false.
      !> Sums, [sum_count, blocks]
      real(wp), allocatable :: sums(:, :)
      !> Impacts in order; only the first `count` are valid
      type(impact_t), allocatable :: impacts(:)
      !> Number of impacts
      integer :: count = 0
      !> Whether the beam has risen above the hop tolerance since the last contact (without one: since the start of the
      !> run)
      logical :: has_separated = .false.
   end type contact_sums_t

   !> Sums of a run.
   type :: block_sums_t
      !> Edges of the blocks, the first and the last included, tau, [0:blocks]
      real(wp), allocatable :: edge(:)
      !> Minimum pause between two impacts, tau (`rest` of &statistics)
      real(wp) :: min_pause = 0.0_wp
      !> Height that a flight must exceed to separate two impacts
      real(wp) :: hop_tolerance = 0.0_wp
      !> Value that the maximum force must reach for an impact to count, if the force is finite
      real(wp) :: threshold = 0.0_wp
      !> Pbar per unit of force
      real(wp) :: force_scale = 1.0_wp
      !> Number of classes of the histograms
      integer :: classes = 1
      !> Whether accelerations are evaluated
      logical :: has_acceleration = .false.
      !> Sums of each contact in the scene's order
      type(contact_sums_t), allocatable :: contact(:)
      !> Sums of the displacement of the tip
      type(contact_sums_t) :: tip
      !> Number of the contact whose displacements are in the statistics of all contacts together (index 0 in
      !> `run_statistics_t`); 0: there is none
      integer :: release_contact = 0
      !> Number of events already processed
      integer :: seen = 0
      !> Tolerances of the searches for extremes, and number of evaluations that remain for them, by the index of the
      !> extreme; the searches at all contacts use them in common
      type(extreme_search_t) :: search_state(sum_count)
   end type block_sums_t

   !> Statistics of a run.
   type :: run_statistics_t
      !> Edges of the blocks, the first and the last included, tau, [0:blocks]
      real(wp), allocatable :: edge(:)
      !> Statistics of all contacts together, index 0, and of each contact, [statistic_count, 0:contacts]; NaN: not
      !> defined
      real(wp), allocatable :: value(:, :)
      !> Half widths of the 95 % confidence intervals of `value`, [statistic_count, 0:contacts]
      real(wp), allocatable :: half_width(:, :)
      !> Statistics as `value`, in each block, [statistic_count, blocks, 0:contacts]
      real(wp), allocatable :: in_block(:, :, :)
      !> Statistics of each stop and body, both sides together, NaN: not defined, [statistic_count, groups in the order
      !> of `measured_groups`]; unallocated: all contacts belong to one stop or body
      real(wp), allocatable :: of_stop(:, :)
      !> Upper edges of the classes, of equal width, of the histogram of the impacts by their maximum force or, at a
      !> rigid contact, by their impulse, [classes, contacts]
      real(wp), allocatable :: class_edge(:, :)
      !> Number of impacts in each class, [classes, contacts]
      integer, allocatable :: class_count(:, :)
      !> Tolerance of extremes, as a fraction of the value, [statistic_count]
      real(wp) :: tolerance(statistic_count) = peak_tolerance
      !> Whether the force of each contact is finite, [contacts]
      logical, allocatable :: has_finite_force(:)
      !> Whether the impact with the maximum impulse of each contact lasts at the end of the blocks, so that its impulse
      !> grows with the length of the blocks, [contacts]
      logical, allocatable :: is_maximum_unfinished(:)
   end type run_statistics_t

   !> Formula by which a statistic follows from the sums of a contact.
   type :: form_t
      character(24) :: name
      !> Index of the sum, of the numerator of a quotient, or of the maximum of a range
      integer :: numerator
      !> Index of the denominator of a quotient, or of the minimum of a range; 0: neither
      integer :: denominator = 0
      !> Whether the statistic is the square root of the quotient
      logical :: is_root = .false.
      !> Whether the statistic is a maximum less a minimum, not a quotient
      logical :: is_range = .false.
   end type form_t

   !> Formulas of all statistics
   type(form_t), parameter :: forms(statistic_count) = [ &
      form_t('mean_force', sum_impulse, sum_time), &
      form_t('rms_force', sum_square_force, sum_time, .true.), &
      form_t('maximum_force', maximum_force), &
      form_t('minimum_force', minimum_force), &
      form_t('force_range', maximum_force, minimum_force, is_range=.true.), &
      form_t('mean_contact_force', sum_force, sum_contact), &
      form_t('rms_contact_force', sum_square_force, sum_contact, .true.), &
      form_t('impact_rate', sum_impacts, sum_time), &
      form_t('mean_impact_velocity', sum_velocity, sum_impacts), &
      form_t('maximum_impact_velocity', maximum_velocity), &
      form_t('mean_impulse', sum_impact_impulse, sum_impacts), &
      form_t('maximum_impulse', maximum_impulse), &
      form_t('contact_time', sum_contact), &
      form_t('contact_share', sum_contact, sum_time), &
      form_t('work_rate', sum_work, sum_time), &
      form_t('mean_displacement', sum_displacement, sum_time), &
      form_t('rms_displacement', sum_square_displacement, sum_time, .true.), &
      form_t('minimum_displacement', minimum_displacement), &
      form_t('maximum_displacement', maximum_displacement), &
      form_t('rms_acceleration', sum_square_acceleration, sum_time, .true.), &
      form_t('minimum_acceleration', minimum_acceleration), &
      form_t('maximum_acceleration', maximum_acceleration), &
      form_t('displacement_range', maximum_displacement, minimum_displacement, is_range=.true.), &
      form_t('mean_tip', sum_tip, sum_time), &
      form_t('rms_tip', sum_square_tip, sum_time, .true.), &
      form_t('minimum_tip', minimum_tip), &
      form_t('maximum_tip', maximum_tip), &
      form_t('rms_tip_acceleration', sum_square_tip_acceleration, sum_time, .true.), &
      form_t('minimum_tip_acceleration', minimum_tip_acceleration), &
      form_t('maximum_tip_acceleration', maximum_tip_acceleration), &
      form_t('tip_range', maximum_tip, minimum_tip, is_range=.true.)]

   !> Sums that are maxima
   integer, parameter :: maxima(*) = [maximum_force, maximum_velocity, maximum_impulse, &
      maximum_displacement, maximum_tip, maximum_acceleration, maximum_tip_acceleration]
   !> Sums that are minima
   integer, parameter :: minima(*) = [minimum_force, minimum_displacement, minimum_tip, minimum_acceleration, &
      minimum_tip_acceleration]

contains


   !> Compute each statistic from the sums of the blocks: its value over all blocks, the half width of its confidence
   !> interval, and its value in each block.
   pure subroutine find_statistics(sums, is_missing, quantile, value, half_width, in_block)
      !> Sums, [blocks]
      real(wp), intent(in) :: sums(:, :)
      !> Whether each sum is not available, [sum_count]
      logical, intent(in) :: is_missing(:)
      !> Quantile of Student's distribution for the number of blocks
      real(wp), intent(in) :: quantile
      real(wp), intent(out) :: value(:)
      real(wp), intent(out) :: half_width(:)
      !> Values in each block, [statistic_count, blocks]
      real(wp), intent(out) :: in_block(:, :)

      type(form_t) :: form
      integer :: i, number

      value = ieee_value(1.0_wp, ieee_quiet_nan)
      half_width = value
      in_block = value(1)
      do number = 1, statistic_count
         form = forms(number)
         i = measure_named(form%name) - first_statistic + 1
         associate (numerator => sums(form%numerator, :))
            if (is_missing(form%numerator)) cycle
            if (form%is_range) then
               associate (minimum => sums(form%denominator, :))
                  ! Without any contribution, minimum and maximum still have their initial values, huge and -huge
                  where (numerator >= minimum) in_block(i, :) = numerator - minimum
                  if (.not. is_missing(form%denominator) .and. maxval(numerator) >= minval(minimum)) then
                     value(i) = maxval(numerator) - minval(minimum)
                  end if
               end associate
               cycle
            end if
            if (form%denominator > 0) then
               call find_quotient(numerator, sums(form%denominator, :), form%is_root, quantile, value(i), &
                  half_width(i), in_block(i, :))
               cycle
            end if
            in_block(i, :) = numerator
            if (any(maxima == form%numerator)) then
               value(i) = maxval(numerator)
            else if (any(minima == form%numerator)) then
               value(i) = minval(numerator)
            else
               value(i) = sum(numerator)
            end if
         end associate
      end do
   end subroutine find_statistics

   !> Quotient of two sums, or its square root. The confidence interval follows from the linearised quotient; a single
   !> block with a nonzero denominator gives no interval. If all quotients agree to rounding, the half width is 0.
   pure subroutine find_quotient(numerator, denominator, is_root, quantile, value, half_width, in_block)
      !> Numerator in each block, [blocks]
      real(wp), intent(in) :: numerator(:)
      !> Denominator in each block, [blocks]
      real(wp), intent(in) :: denominator(:)
      logical, intent(in) :: is_root
      real(wp), intent(in) :: quantile
      !> NaN if the denominator is zero
      real(wp), intent(inout) :: value
      real(wp), intent(inout) :: half_width
      real(wp), intent(inout) :: in_block(:)

      real(wp) :: deviation(size(numerator))
      real(wp) :: number, quotient, spread
      integer :: i

      do i = 1, size(numerator)
         if (denominator(i) > 0.0_wp) in_block(i) = root_of(numerator(i)/denominator(i))
      end do
      if (.not. sum(denominator) > 0.0_wp) return
      number = real(size(numerator), wp)
      quotient = sum(numerator)/sum(denominator)
      value = root_of(quotient)
      if (count(denominator > 0.0_wp) < 2) return
      deviation = numerator - quotient*denominator
      if (all(abs(deviation) <= number*epsilon(number)*abs(numerator))) deviation = 0.0_wp
      spread = sqrt(sum(deviation**2)/(number*(number - 1.0_wp)))
      half_width = quantile*spread*number/sum(denominator)
      if (is_root .and. value > 0.0_wp) half_width = half_width/(2.0_wp*value)

   contains

      pure real(wp) function root_of(number) result(root)
         real(wp), intent(in) :: number

         root = number
         if (is_root) root = sqrt(max(number, 0.0_wp))
      end function root_of
   end subroutine find_quotient

end module statistic_types
