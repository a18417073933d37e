!> Loads that hardly change while a phase lasts, on surfaces that are pressed: where terms of the motion hardly begin to
!> swing in a run, what balances the loads would be far greater than the motion. Swings of the load about as fast as the
!> phase is long add up to it, and their answers are not greater (docs/theory.md, section 18).
module slow_loads
   use applied_loads, only: applied_loads_t
   use constrained_sets, only: constrained_set_t
   use joint_modes, only: joint_modes_t
   use kinds, only: pi, wp
   use load_courses, only: load_segment_t
   use forced_responses, only: answer_at, forced_response_t, ready_for_terms, unit_responses_t
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: forced_terms, swings, swings_of, shares_of

   !> A term is slow if its exponent times the length of the run is less than this.
   real(wp), parameter :: greatest_slow = 0.1_wp

   !> So many swings; their frequencies times the length of the phase are between these, their squares Chebyshev's
   !> points: exp(i w t) comes from them to rounding, up to the lower. The length is stretched by one of these, so that
   !> none is near to an exponent.
   integer, parameter :: swings = 12
   real(wp), parameter :: stretches(4) = [1.0_wp, 1.05_wp, 1.11_wp, 1.18_wp]
   real(wp), parameter :: lowest = 0.5_wp
   real(wp), parameter :: highest = 3.5_wp

   integer :: k
   real(wp), parameter :: square(swings) = [(0.5_wp*(highest**2 + lowest**2) + 0.5_wp*(highest**2 - lowest**2) &
      *cos(pi*(real(k, wp) - 0.5_wp)/real(swings, wp)), k=1, swings)]

contains

   !> What loads do to a set on surfaces that are pressed, as a phase begins.
   subroutine forced_terms(constrained, joint, compliant, spring, loads, is_new, set, forced)
      type(constrained_set_t), intent(in) :: constrained
      type(joint_modes_t), intent(in) :: joint
      !> Surfaces that yield and are closed, and all impedances
      integer, intent(in) :: compliant(:)
      type(impedance_t), intent(in) :: spring(:)
      type(applied_loads_t), intent(in) :: loads
      !> The set has not been driven by them so far
      logical, intent(in) :: is_new
      type(unit_responses_t), intent(inout) :: set
      !> Has the answers of the set
      type(forced_response_t), intent(inout) :: forced

      logical :: is_slow

      is_slow = any(abs(joint%exponent)*loads%duration < greatest_slow) .or. &
         any(constrained%oscillators%frequency(joint%inactive)*loads%duration < greatest_slow)
      if (is_slow) call swing_slow_loads(constrained, joint, compliant, spring, loads, set, forced)
      if (is_slow .or. is_new) call ready_for_terms(joint%exponent, joint%shape, forced%frequency, set)
   end subroutine forced_terms

   !> Let swings stand for all of the loads that is slow.
   subroutine swing_slow_loads(constrained, joint, compliant, spring, loads, set, forced)
      type(constrained_set_t), intent(in) :: constrained
      type(joint_modes_t), intent(in) :: joint
      !> Surfaces that yield and are closed, and all impedances
      integer, intent(in) :: compliant(:)
      type(impedance_t), intent(in) :: spring(:)
      type(applied_loads_t), intent(in) :: loads
      type(unit_responses_t), intent(in) :: set
      !> Its phase has begun
      type(forced_response_t), intent(inout) :: forced

      complex(wp) :: answer(set%at%rows), share(swings)
      complex(wp), allocatable :: harmonic(:, :)
      logical :: nowhere(constrained%count)
      real(wp) :: length, rooms(size(stretches))
      integer :: g, k, others

      nowhere = .false.
      forced%until = min(forced%until, forced%tau + loads%duration)
      length = forced%until - forced%tau
      rooms = [(room_beside([joint%exponent, cmplx(-constrained%oscillators%decay(joint%inactive), &
         constrained%oscillators%spread(joint%inactive), wp)], swings_of(length*stretches(k))), k=1, size(stretches))]
      length = length*stretches(maxloc(rooms, dim=1))
      others = size(loads%frequencies)
      forced%frequency = [loads%frequencies, swings_of(length)]
      allocate (harmonic(set%at%rows, others + swings), source=(0.0_wp, 0.0_wp))
      do g = 1, loads%count
         call shares_of(forced%segment(g), length, share)
         if (loads%harmonic(g) > 0 .and. .not. is_slow(forced%segment(g), length)) then
            associate (m => loads%harmonic(g))
               harmonic(:, m) = harmonic(:, m) + forced%segment(g)%harmonic*set%harmonic(:, g)
            end associate
         end if
         if (all(abs(share) <= 0.0_wp)) cycle
         do k = 1, swings
            call answer_at(constrained, compliant, spring, set, g, cmplx(0.0_wp, forced%frequency(others + k), wp), &
               nowhere, &
               answer)
            harmonic(:, others + k) = harmonic(:, others + k) + share(k)*answer
         end do
      end do
      call move_alloc(harmonic, forced%harmonic)
      forced%constant(:) = 0.0_wp
      forced%slope(:) = 0.0_wp
   end subroutine swing_slow_loads

   !> Their frequencies, where they serve for a time.
   pure function swings_of(length) result(frequency)
      real(wp), intent(in) :: length
      real(wp) :: frequency(swings)

      frequency = sqrt(square)/length
   end function swings_of

   !> How far do frequencies stay from all exponents, as a share of them?
   pure function room_beside(exponent, frequency) result(room)
      complex(wp), intent(in) :: exponent(:)
      real(wp), intent(in) :: frequency(:)
      real(wp) :: room

      integer :: k

      room = minval([(minval(abs(cmplx(0.0_wp, frequency(k), wp) - exponent))/frequency(k), k=1, size(frequency))])
   end function room_beside

   !> Does the harmonic of a piece hardly swing in a time?
   pure function is_slow(segment, length) result(is)
      type(load_segment_t), intent(in) :: segment
      real(wp), intent(in) :: length
      logical :: is

      is = segment%frequency*length < lowest
   end function is_slow

   !> What of a piece each swing has: as functions of the square of w, cos(w t) and sin(w t)/w are interpolated.
   pure subroutine shares_of(segment, length, share)
      type(load_segment_t), intent(in) :: segment
      !> No later instant is asked for
      real(wp), intent(in) :: length
      !> Re sum share exp(i w t) is constant + slope t, and the harmonic if that is slow
      complex(wp), intent(out) :: share(swings)

      associate (w => swings_of(length))
         share = shares_at(0.0_wp)*cmplx(segment%constant, -segment%slope/w, wp)
         if (is_slow(segment, length)) share = share + shares_at((segment%frequency*length)**2) &
            *cmplx(real(segment%harmonic, wp), aimag(segment%harmonic)*segment%frequency/w, wp)
      end associate
   end subroutine shares_of

   !> Lagrange's polynomials.
   pure function shares_at(x) result(share)
      real(wp), intent(in) :: x
      real(wp) :: share(swings)

      logical :: is_other(swings)
      integer :: k

      do k = 1, swings
         is_other = abs(square(k) - square) > 0.0_wp
         share(k) = product(x - square, mask=is_other)/product(square(k) - square, mask=is_other)
      end do
   end function shares_at

end module slow_loads
