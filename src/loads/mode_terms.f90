!> A mode that swings alone, of itself and as loads drive it from rest, as a sum of amplitude exp(exponent t) whose
!> amplitudes are not much greater than the motion (docs/theory.md, section 20).
!>
!> Its Laplace transform is rational. A pole that is far from the others, beside the inverse of the time for which the
!> sum serves, gives a term; poles near to each other give the points of a circle around them (Cauchy's formula).
module mode_terms
   use damped_oscillators, only: oscillators_t
   use driven_modes, only: driven_mode_t, make_driven_mode
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: mode_terms_t, find_mode_terms, slow_points, slow_exponents

   !> All that is slow, of all modes, shares one circle around 0. Its points in the upper half-plane, to which the
   !> others are conjugate, and its radius times the length of the phase
   integer, parameter :: slow_points = 16
   real(wp), parameter :: slow_radius = 4.0_wp
   !> Slow is what times that length is less than this, and the other exponent of the mode with it, if it is less than
   !> that: so no exponent that is not slow is near to one that is.
   real(wp), parameter :: greatest_slow = 1.0_wp
   real(wp), parameter :: greatest_with_slow = 1.25_wp
   !> A load on a slow mode is slow, too, if its frequency times the length is less than this.
   real(wp), parameter :: greatest_slow_load = 1.5_wp

   !> A circle around two exponents: half its points, and its least radius times the length of the phase. Those of a
   !> mode next to critical damping are this much nearer to its centre than it, with a radius of a share of the decay,
   !> if that is greater.
   integer, parameter :: half_circle = 10
   real(wp), parameter :: radius_times_length = 1.2_wp
   !> So much times the inverse of the length a harmonic and the mode with which it resonates are apart at most.
   real(wp), parameter :: greatest_resonance = 0.5_wp
   real(wp), parameter :: nearness = 0.125_wp
   real(wp), parameter :: share_of_decay = 0.125_wp

   !> Directions of these points, and of all of a circle that has no conjugate
   integer :: k
   complex(wp), parameter :: slow_direction(slow_points) = [(exp(cmplx(0.0_wp, pi*(real(k, wp) - 0.5_wp) &
      /real(slow_points, wp), wp)), k=1, slow_points)]
   complex(wp), parameter :: direction(2*half_circle) = [(exp(cmplx(0.0_wp, pi*(real(k, wp) - 0.5_wp) &
      /real(half_circle, wp), wp)), k=1, 2*half_circle)]

   !> offset + slope t + Re sum amplitude exp(exponent t): the mode (1), and with 2 zeta times its rate (2), which makes
   !> the reactions of surfaces.
   type :: mode_terms_t
      real(wp) :: offset(2) = 0.0_wp
      real(wp) :: slope(2) = 0.0_wp
      !> At the points that all modes share
      complex(wp) :: slow(2, slow_points) = (0.0_wp, 0.0_wp)
      !> Besides, [terms], [2, terms]
      complex(wp), allocatable :: exponent(:), amplitude(:, :)
   end type mode_terms_t

   !> The mode: exponents -decay +- i spread if it is below critical damping, else -decay and -decay - 2 spread, and
   !> what else `oscillators_t` holds of it.
   type :: lone_mode_t
      logical :: swings = .true.
      real(wp) :: decay = 0.0_wp
      real(wp) :: spread = 0.0_wp
      real(wp) :: square = 1.0_wp
      real(wp) :: two_zeta = 0.0_wp
      real(wp) :: mass_rate = 0.0_wp
      !> Its exponents, and 2 a = -their sum
      complex(wp) :: own(2) = (0.0_wp, 0.0_wp)
      real(wp) :: damping = 0.0_wp
      !> No later instant is asked for
      real(wp) :: length = 1.0_wp
   end type lone_mode_t

contains

   !> The terms of a mode.
   pure subroutine find_mode_terms(oscillators, place, start, driven_motions, length, terms)
      type(oscillators_t), intent(in) :: oscillators
      !> Which of them
      integer, intent(in) :: place
      !> z and z' at the start
      real(wp), intent(in) :: start(2)
      !> What drives it from rest besides
      type(driven_mode_t), intent(in) :: driven_motions(:)
      !> No later instant is asked for, > 0
      real(wp), intent(in) :: length
      type(mode_terms_t), intent(out) :: terms

      type(lone_mode_t) :: mode
      type(driven_mode_t) :: alone
      real(wp) :: omega(2)
      integer :: k
      logical :: is_apart(size(driven_motions))

      alone = make_driven_mode(oscillators, place)
      mode = lone_mode_t(swings=place <= oscillators%oscillating, decay=oscillators%decay(place), &
         spread=oscillators%spread(place), square=oscillators%square(place), two_zeta=oscillators%two_zeta, &
         mass_rate=oscillators%mass_rate(place), own=alone%own, damping=alone%damping, length=length)
      allocate (terms%exponent(0), terms%amplitude(2, 0))
      ! besides what follows the loads there is a swing
      omega = start
      do k = 1, size(driven_motions)
         is_apart(k) = stands_apart(mode, driven_motions(k))
         if (is_apart(k)) call add_harmonic(mode, driven_motions(k), omega, terms)
      end do
      call add_near(mode, omega, pack(driven_motions, .not. is_apart), terms)
   end subroutine find_mode_terms

   !> Is the pole of a load far from those of the mode, and from 0 where they are slow?
   pure function stands_apart(mode, forced) result(does)
      type(lone_mode_t), intent(in) :: mode
      type(driven_mode_t), intent(in) :: forced
      logical :: does

      if (abs(mode%own(1))*mode%length <= greatest_slow) then
         does = forced%frequency*mode%length > greatest_slow_load
      else
         does = forced%frequency > 0.0_wp .and. &
            abs(cmplx(0.0_wp, forced%frequency, wp) - mode%own(1))*mode%length > greatest_resonance
      end if
   end function stands_apart

   !> The terms but for those of harmonics that stand apart.
   pure subroutine add_near(mode, start, driven_motions, terms)
      type(lone_mode_t), intent(in) :: mode
      real(wp), intent(in) :: start(2)
      type(driven_mode_t), intent(in) :: driven_motions(:)
      type(mode_terms_t), intent(inout) :: terms

      real(wp) :: fast, rates(2), omega(2)
      integer :: k

      rates = abs(mode%own)
      if (rates(2)*mode%length <= greatest_with_slow) then
         call add_slow(mode, start, driven_motions, 0.0_wp, terms)
         return
      end if
      omega = start
      if (rates(1)*mode%length <= greatest_slow) then
         if (size(driven_motions) > 0) then
            fast = -0.5_wp*real(transform_of(driven_motions, mode%own(2)), wp)/mode%spread
            call add_slow(mode, [0.0_wp, 0.0_wp], driven_motions, fast, terms)
            omega = omega + fast*[1.0_wp, real(mode%own(2), wp)]
         end if
      else
         do k = 1, size(driven_motions)
            if (driven_motions(k)%frequency > 0.0_wp) then
               call add_resonance(mode, driven_motions(k), omega, terms)
            else
               call add_steady(mode, driven_motions(k), omega, terms)
            end if
         end do
      end if
      call add_swing(mode, omega, terms)
   end subroutine add_near

   !> The points of the circle of all that is slow.
   pure function slow_exponents(length, count) result(s)
      real(wp), intent(in) :: length
      !> So many of them
      integer, intent(in) :: count
      complex(wp) :: s(count)

      s = slow_radius/length*slow_direction(:count)
   end function slow_exponents

   !> Laplace transform of what drives a mode.
   pure function transform_of(driven_motions, s) result(value)
      type(driven_mode_t), intent(in) :: driven_motions(:)
      complex(wp), intent(in) :: s
      complex(wp) :: value

      integer :: k

      value = (0.0_wp, 0.0_wp)
      do k = 1, size(driven_motions)
         associate (force => driven_motions(k)%force, turning => cmplx(0.0_wp, driven_motions(k)%frequency, wp))
            if (driven_motions(k)%is_ramp) then
               value = value + real(force, wp)/s**2
            else
               value = value + 0.5_wp*(force/(s - turning) + conjg(force)/(s + turning))
            end if
         end associate
      end do
   end function transform_of

   !> The slow part of a mode, at the points that all share.
   pure subroutine add_slow(mode, start, driven_motions, fast, terms)
      type(lone_mode_t), intent(in) :: mode
      real(wp), intent(in) :: start(2)
      type(driven_mode_t), intent(in) :: driven_motions(:)
      !> Amplitude of its fast exponent, which is left out
      real(wp), intent(in) :: fast
      type(mode_terms_t), intent(inout) :: terms

      complex(wp) :: forced, reaction, s, omega, z
      real(wp) :: viscous(2)
      integer :: j
      logical :: is_stiff

      associate (radius => slow_radius/mode%length, alpha => mode%mass_rate)
         ! with 2 zeta times its rate it swings as by itself
         viscous(1) = start(1) + mode%two_zeta*start(2)
         viscous(2) = start(2) - mode%two_zeta*(mode%square*viscous(1) + alpha*start(2))
         is_stiff = mode%square*(1.0_wp + mode%two_zeta*radius) > radius*(radius + alpha)
         do j = 1, slow_points
            s = radius*slow_direction(j)
            forced = transform_of(driven_motions, s)
            omega = 1.0_wp/((s - mode%own(1))*(s - mode%own(2)))
            z = omega*forced - fast/(s - mode%own(2))
            ! the same but for what has no poles within the circle
            if (is_stiff) then
               reaction = (forced - s*(s + alpha)*z)/mode%square
            else
               reaction = (1.0_wp + mode%two_zeta*s)*z
            end if
            z = z + omega*((s + mode%damping)*start(1) + start(2))
            reaction = reaction + omega*((s + mode%damping)*viscous(1) + viscous(2))
            terms%slow(:, j) = terms%slow(:, j) + s/real(slow_points, wp)*[z, reaction]
         end do
      end associate
   end subroutine add_slow

   !> A constant or a slope far from which no exponent is slow: the mode follows, and swings about that.
   pure subroutine add_steady(mode, forced, omega, terms)
      type(lone_mode_t), intent(in) :: mode
      type(driven_mode_t), intent(in) :: forced
      !> z and z' at the start of what swings of itself; less by those
      real(wp), intent(inout) :: omega(2)
      type(mode_terms_t), intent(inout) :: terms

      real(wp) :: static, rate

      static = real(forced%force, wp)/mode%square
      rate = 0.0_wp
      if (forced%is_ramp) then
         rate = static
         static = -static*mode%damping/mode%square
      end if
      terms%offset = terms%offset + [static, static + mode%two_zeta*rate]
      terms%slope = terms%slope + rate
      omega = omega - [static, rate]
   end subroutine add_steady

   !> A harmonic that stands apart: the mode follows, and swings about that.
   pure subroutine add_harmonic(mode, forced, omega, terms)
      type(lone_mode_t), intent(in) :: mode
      type(driven_mode_t), intent(in) :: forced
      !> z and z' at the start of what swings of itself; less by those
      real(wp), intent(inout) :: omega(2)
      type(mode_terms_t), intent(inout) :: terms

      complex(wp) :: answer, turning

      turning = cmplx(0.0_wp, forced%frequency, wp)
      answer = forced%force/((turning - mode%own(1))*(turning - mode%own(2)))
      omega = omega - real(answer*[(1.0_wp, 0.0_wp), turning], wp)
      call add_terms([turning], [answer], [1.0_wp + mode%two_zeta*turning], terms)
   end subroutine add_harmonic

   !> A harmonic that turns almost as the mode does, which is below critical damping: a circle around both.
   pure subroutine add_resonance(mode, forced, omega, terms)
      type(lone_mode_t), intent(in) :: mode
      type(driven_mode_t), intent(in) :: forced
      !> Grows by what swings backwards
      real(wp), intent(inout) :: omega(2)
      type(mode_terms_t), intent(inout) :: terms

      complex(wp), dimension(2*half_circle) :: s, arm, z
      complex(wp) :: turning, back

      turning = cmplx(0.0_wp, forced%frequency, wp)
      arm = radius_times_length/mode%length*direction
      s = 0.5_wp*(turning + mode%own(1)) + arm
      back = forced%force/((mode%own(2) - turning)*(mode%own(2) - mode%own(1)))
      z = (forced%force/((s - turning)*(s - mode%own(1))) - back)/(s - mode%own(2))
      omega = omega + real(back*[(1.0_wp, 0.0_wp), mode%own(2)], wp)
      call add_terms(s, arm/real(size(arm), wp)*z, 1.0_wp + mode%two_zeta*s, terms)
   end subroutine add_resonance

   !> What swings of itself.
   pure subroutine add_swing(mode, start, terms)
      type(lone_mode_t), intent(in) :: mode
      !> z and z' at the start
      real(wp), intent(in) :: start(2)
      type(mode_terms_t), intent(inout) :: terms

      complex(wp) :: arm(half_circle), share, viscous(2)
      real(wp) :: center, radius

      center = 0.5_wp*mode%damping
      radius = max(share_of_decay*center, radius_times_length/mode%length)
      if (mode%spread <= nearness*radius) then
         arm = radius*direction(:half_circle)
         associate (s => arm - center, square => merge(-1.0_wp, 1.0_wp, mode%swings)*mode%spread**2)
            call add_terms(s, arm/real(half_circle, wp)*((arm + center)*start(1) + start(2))/(arm**2 - square), &
               1.0_wp + mode%two_zeta*s, terms)
         end associate
         return
      end if
      ! 1 + 2 zeta s of an exponent, without cancellation
      viscous = 1.0_wp + mode%two_zeta*mode%own
      if (mode%square >= mode%mass_rate**2) viscous = -mode%own*(mode%own + mode%mass_rate)/mode%square
      if (mode%swings) then
         call add_terms(mode%own(1:1), [cmplx(start(1), -(start(2) + mode%decay*start(1))/mode%spread, wp)], &
            viscous(1:1), terms)
      else
         share = -0.5_wp*(start(2) + mode%decay*start(1))/mode%spread
         call add_slower(mode, start(1) - share, viscous(1), terms)
         call add_terms(mode%own(2:2), [share], viscous(2:2), terms)
      end if
   end subroutine add_swing

   !> The slower exponent of two, which may be slow.
   pure subroutine add_slower(mode, share, viscous, terms)
      type(lone_mode_t), intent(in) :: mode
      complex(wp), intent(in) :: share
      !> 1 + 2 zeta s
      complex(wp), intent(in) :: viscous
      type(mode_terms_t), intent(inout) :: terms

      complex(wp) :: s
      integer :: j

      if (mode%decay*mode%length > greatest_slow) then
         call add_terms(mode%own(1:1), [share], [viscous], terms)
         return
      end if
      do j = 1, slow_points
         s = slow_radius/mode%length*slow_direction(j)
         terms%slow(:, j) = terms%slow(:, j) &
            + s/real(slow_points, wp)*share/(s - mode%own(1))*[(1.0_wp, 0.0_wp), viscous]
      end do
   end subroutine add_slower

   !> Further terms.
   pure subroutine add_terms(exponent, amplitude, viscous, terms)
      complex(wp), intent(in) :: exponent(:)
      complex(wp), intent(in) :: amplitude(:)
      !> 1 + 2 zeta times the exponent
      complex(wp), intent(in) :: viscous(:)
      type(mode_terms_t), intent(inout) :: terms

      complex(wp), allocatable :: both(:, :)
      integer :: n

      n = size(terms%exponent)
      allocate (both(2, n + size(exponent)))
      both(:, :n) = terms%amplitude
      both(1, n + 1:) = amplitude
      both(2, n + 1:) = amplitude*viscous
      call move_alloc(both, terms%amplitude)
      terms%exponent = [terms%exponent, exponent]
   end subroutine add_terms

end module mode_terms
