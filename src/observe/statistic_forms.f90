!> Statistics as quotients and extremes of the sums of blocks of time, with confidence intervals from the scatter of the
!> blocks (docs/theory.md, section 20).
module statistic_forms
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use measure_list, only: first_statistic, measure_named
   use statistic_types, only: maximum_acceleration, maximum_displacement, maximum_force, maximum_impulse, &
      maximum_tip, maximum_tip_acceleration, maximum_velocity, minimum_acceleration, minimum_displacement, &
      minimum_force, minimum_tip, minimum_tip_acceleration, statistic_count, sum_contact, &
      sum_displacement, sum_force, sum_impact_impulse, sum_impacts, sum_impulse, sum_square_acceleration, &
      sum_square_displacement, sum_square_force, sum_square_tip, sum_square_tip_acceleration, sum_time, sum_tip, &
      sum_velocity, sum_work
   implicit none (type, external)
   private
   public :: forms, minima, find_statistics

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

end module statistic_forms
