!> Motion of a mode that is not coupled to other modes, free and driven by loads from rest, as a sum of terms amplitude
!> exp(exponent t), with t the time since the start of the phase and amplitudes of about the magnitude of the motion
!> (docs/theory.md, section 20).
!>
!> The Laplace transform of the motion is rational. A pole that is far from all other poles, compared with the inverse
!> length of the phase, gives one term. Close poles would give large terms that cancel; instead, the points of a circle
!> around a group of close poles give the terms of Cauchy's integral by the trapezoidal rule.
module mode_terms
   use damped_oscillators, only: oscillators_t
   use driven_modes, only: driven_mode_t, make_driven_mode
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: mode_terms_t, find_mode_terms, slow_points, slow_exponents

   !> Number of points, in the upper half-plane, of the circle around 0 that the slow poles of all modes have in common;
   !> the other points of this slow circle are their conjugates.
   integer, parameter :: slow_points = 16
   !> Radius of the slow circle times the length of the phase.
   real(wp), parameter :: slow_radius = 4.0_wp
   !> An exponent is slow if its magnitude times the length of the phase is less than this.
   real(wp), parameter :: max_slow = 1.0_wp
   !> The other exponent of a mode with a slow exponent counts as slow up to this value, so that no fast exponent is
   !> near to a slow one.
   real(wp), parameter :: max_with_slow = 1.25_wp
   !> A load on a slow mode is slow if its frequency times the length of the phase is less than this.
   real(wp), parameter :: max_slow_load = 1.5_wp

   !> Half the number of points of a circle around two exponents.
   integer, parameter :: half_circle = 10
   !> Minimum radius of a circle around two exponents times the length of the phase.
   real(wp), parameter :: radius_times_length = 1.2_wp
   !> Maximum distance, times the length of the phase, between the exponents of a harmonic and of a mode in resonance.
   real(wp), parameter :: max_resonance = 0.5_wp
   !> Both exponents of a mode near critical damping get one circle around them if their distance from its centre is
   !> less than this fraction of its radius.
   real(wp), parameter :: nearness = 0.125_wp
   !> Minimum radius of a circle around both exponents of a mode near critical damping, as a fraction of the decay rate.
   real(wp), parameter :: fraction_of_decay = 0.125_wp

   ! implied-do variable of the following constants
   integer :: k
   !> Directions of the points of the slow circle in the upper half-plane.
   complex(wp), parameter :: slow_direction(slow_points) = [(exp(cmplx(0.0_wp, pi*(real(k, wp) - 0.5_wp) &
      /real(slow_points, wp), wp)), k=1, slow_points)]
   !> Directions of all points of a circle around two exponents.
   complex(wp), parameter :: direction(2*half_circle) = [(exp(cmplx(0.0_wp, pi*(real(k, wp) - 0.5_wp) &
      /real(half_circle, wp), wp)), k=1, 2*half_circle)]

   !> The sum offset + slope t + Re sum amplitude exp(exponent t), for two quantities: component 1 is the modal
   !> displacement z, component 2 is z + 2 zeta z', with z' the modal velocity, which gives contact reactions.
   type :: mode_terms_t
      real(wp) :: offset(2) = 0.0_wp
      real(wp) :: slope(2) = 0.0_wp
      !> Amplitudes at the points of the slow circle
      complex(wp) :: slow(2, slow_points) = (0.0_wp, 0.0_wp)
      !> Further exponents, [terms]
      complex(wp), allocatable :: exponent(:)
      !> Further amplitudes, [2, terms]
      complex(wp), allocatable :: amplitude(:, :)
   end type mode_terms_t

   !> A mode. Its exponents are -decay +- i spread if it is below critical damping, else -decay and -decay - 2 spread;
   !> W^2, 2 zeta and alpha are `square`, `two_zeta` and `mass_rate`, as in `oscillators_t`.
   type :: single_mode_t
      !> Whether the mode is below critical damping
      logical :: oscillates = .true.
      real(wp) :: decay = 0.0_wp
      real(wp) :: spread = 0.0_wp
      real(wp) :: square = 1.0_wp
      real(wp) :: two_zeta = 0.0_wp
      real(wp) :: mass_rate = 0.0_wp
      !> Exponents of the mode, the slow one first
      complex(wp) :: exponent(2) = (0.0_wp, 0.0_wp)
      !> Minus the sum of the exponents, 2 a
      real(wp) :: damping = 0.0_wp
      !> Maximum time at which the sum is evaluated
      real(wp) :: length = 1.0_wp
   end type single_mode_t

contains

   !> Find the terms of a mode.
   pure subroutine find_mode_terms(oscillators, place, start, driven_motions, length, terms)
      type(oscillators_t), intent(in) :: oscillators
      !> Index of the mode
      integer, intent(in) :: place
      !> Modal displacement z and velocity z' at the start
      real(wp), intent(in) :: start(2)
      !> Motions driven from rest by loads, added to the free motion
      type(driven_mode_t), intent(in) :: driven_motions(:)
      !> Maximum time at which the sum is evaluated, > 0
      real(wp), intent(in) :: length
      type(mode_terms_t), intent(out) :: terms

      type(single_mode_t) :: mode
      type(driven_mode_t) :: free_mode
      ! displacement and velocity at the start of the free motion
      real(wp) :: free_start(2)
      integer :: k
      ! whether the pole of each load gives a term of its own
      logical :: separate(size(driven_motions))

      free_mode = make_driven_mode(oscillators, place)
      mode = single_mode_t(oscillates=place <= oscillators%underdamped, decay=oscillators%decay(place), &
         spread=oscillators%spread(place), square=oscillators%square(place), two_zeta=oscillators%two_zeta, &
         mass_rate=oscillators%mass_rate(place), exponent=free_mode%exponent, damping=free_mode%damping, length=length)
      allocate (terms%exponent(0), terms%amplitude(2, 0))
      ! the steady response to each separate harmonic changes the initial state of the free motion
      free_start = start
      do k = 1, size(driven_motions)
         separate(k) = is_separate(mode, driven_motions(k))
         if (separate(k)) call add_harmonic(mode, driven_motions(k), free_start, terms)
      end do
      call add_other_terms(mode, free_start, pack(driven_motions, .not. separate), terms)
   end subroutine find_mode_terms

   !> Whether the pole of a load is far from the poles of the mode and, if these are slow, from 0.
   pure logical function is_separate(mode, forced) result(answer)
      type(single_mode_t), intent(in) :: mode
      type(driven_mode_t), intent(in) :: forced

      if (abs(mode%exponent(1))*mode%length <= max_slow) then
         answer = forced%frequency*mode%length > max_slow_load
      else
         answer = forced%frequency > 0.0_wp .and. &
            abs(cmplx(0.0_wp, forced%frequency, wp) - mode%exponent(1))*mode%length > max_resonance
      end if
   end function is_separate

   !> Add all terms except those of separate harmonics. A fast exponent of a mode whose other exponent is slow gets a
   !> term of its own.
   pure subroutine add_other_terms(mode, start, driven_motions, terms)
      type(single_mode_t), intent(in) :: mode
      real(wp), intent(in) :: start(2)
      type(driven_mode_t), intent(in) :: driven_motions(:)
      type(mode_terms_t), intent(inout) :: terms

      ! amplitude of the term of the fast exponent
      real(wp) :: fast
      ! magnitudes of the exponents
      real(wp) :: rates(2)
      ! displacement and velocity at the start of the free motion, from which those of quasi-static responses are
      ! subtracted
      real(wp) :: free_start(2)
      ! constant and slope of a quasi-static response
      real(wp) :: static, rate
      integer :: k

      rates = abs(mode%exponent)
      if (rates(2)*mode%length <= max_with_slow) then
         call add_slow(mode, start, driven_motions, 0.0_wp, terms)
         return
      end if
      free_start = start
      if (rates(1)*mode%length <= max_slow) then
         if (size(driven_motions) > 0) then
            fast = -0.5_wp*real(transform_of(driven_motions, mode%exponent(2)), wp)/mode%spread
            call add_slow(mode, [0.0_wp, 0.0_wp], driven_motions, fast, terms)
            free_start = free_start + fast*[1.0_wp, real(mode%exponent(2), wp)]
         end if
      else
         do k = 1, size(driven_motions)
            if (driven_motions(k)%frequency > 0.0_wp) then
               call add_resonance(mode, driven_motions(k), free_start, terms)
            else
               ! the quasi-static response of a mode without slow exponents to a constant or a ramp
               static = real(driven_motions(k)%force, wp)/mode%square
               rate = 0.0_wp
               if (driven_motions(k)%is_ramp) then
                  rate = static
                  static = -static*mode%damping/mode%square
               end if
               terms%offset = terms%offset + [static, static + mode%two_zeta*rate]
               terms%slope = terms%slope + rate
               free_start = free_start - [static, rate]
            end if
         end do
      end if
      call add_free_motion(mode, free_start, terms)
   end subroutine add_other_terms

   !> Points of the slow circle.
   pure function slow_exponents(length, count) result(s)
      real(wp), intent(in) :: length
      !> Number of points
      integer, intent(in) :: count
      complex(wp) :: s(count)

      s = slow_radius/length*slow_direction(:count)
   end function slow_exponents

   !> Laplace transform of the loads on a mode.
   pure function transform_of(driven_motions, s) result(value)
      type(driven_mode_t), intent(in) :: driven_motions(:)
      complex(wp), intent(in) :: s
      complex(wp) :: value

      integer :: k

      value = (0.0_wp, 0.0_wp)
      do k = 1, size(driven_motions)
         associate (force => driven_motions(k)%force, load_exponent => cmplx(0.0_wp, driven_motions(k)%frequency, wp))
            if (driven_motions(k)%is_ramp) then
               value = value + real(force, wp)/s**2
            else
               value = value + 0.5_wp*(force/(s - load_exponent) + conjg(force)/(s + load_exponent))
            end if
         end associate
      end do
   end function transform_of

   !> Add the slow part of a mode at the points of the slow circle.
   pure subroutine add_slow(mode, start, driven_motions, fast, terms)
      type(single_mode_t), intent(in) :: mode
      real(wp), intent(in) :: start(2)
      type(driven_mode_t), intent(in) :: driven_motions(:)
      !> Amplitude of the fast exponent of the mode, whose term is left out
      real(wp), intent(in) :: fast
      type(mode_terms_t), intent(inout) :: terms

      ! a point of the circle
      complex(wp) :: s
      ! Laplace transform of the loads on the mode
      complex(wp) :: forced
      ! Laplace transform of z
      complex(wp) :: z
      ! Laplace transform of z + 2 zeta z'
      complex(wp) :: reaction
      ! transfer function of the mode, from load to displacement
      complex(wp) :: transfer
      ! z + 2 zeta z' and its rate at the start
      real(wp) :: viscous(2)
      integer :: j
      ! whether the stiffness of the mode outweighs its inertia at the radius of the circle
      logical :: is_stiff

      associate (radius => slow_radius/mode%length, alpha => mode%mass_rate)
         ! z + 2 zeta z' is a free motion, too, with these initial values
         viscous(1) = start(1) + mode%two_zeta*start(2)
         viscous(2) = start(2) - mode%two_zeta*(mode%square*viscous(1) + alpha*start(2))
         is_stiff = mode%square*(1.0_wp + mode%two_zeta*radius) > radius*(radius + abs(alpha))
         do j = 1, slow_points
            s = radius*slow_direction(j)
            forced = transform_of(driven_motions, s)
            transfer = 1.0_wp/((s - mode%exponent(1))*(s - mode%exponent(2)))
            z = transfer*forced - fast/(s - mode%exponent(2))
            ! both forms equal z + 2 zeta z' except for parts without poles inside the circle, which contribute nothing;
            ! the form with the smaller rounding error is taken
            if (is_stiff) then
               reaction = (forced - s*(s + alpha)*z)/mode%square
            else
               reaction = (1.0_wp + mode%two_zeta*s)*z
            end if
            z = z + transfer*((s + mode%damping)*start(1) + start(2))
            reaction = reaction + transfer*((s + mode%damping)*viscous(1) + viscous(2))
            terms%slow(:, j) = terms%slow(:, j) + s/real(slow_points, wp)*[z, reaction]
         end do
      end associate
   end subroutine add_slow

   !> Add the steady response to a separate harmonic.
   pure subroutine add_harmonic(mode, forced, free_start, terms)
      type(single_mode_t), intent(in) :: mode
      type(driven_mode_t), intent(in) :: forced
      !> Displacement z and velocity z' at the start of the free motion, from which those of the response are subtracted
      real(wp), intent(inout) :: free_start(2)
      type(mode_terms_t), intent(inout) :: terms

      complex(wp) :: response, load_exponent

      load_exponent = cmplx(0.0_wp, forced%frequency, wp)
      response = forced%force/((load_exponent - mode%exponent(1))*(load_exponent - mode%exponent(2)))
      free_start = free_start - real(response*[(1.0_wp, 0.0_wp), load_exponent], wp)
      call add_terms([load_exponent], [response], [1.0_wp + mode%two_zeta*load_exponent], terms)
   end subroutine add_harmonic

   !> Add the response to a harmonic in resonance with a mode below critical damping, by a circle around both exponents.
   pure subroutine add_resonance(mode, forced, free_start, terms)
      type(single_mode_t), intent(in) :: mode
      type(driven_mode_t), intent(in) :: forced
      !> Displacement z and velocity z' at the start of the free motion, to which those of the term with the conjugate
      !> exponent are added
      real(wp), intent(inout) :: free_start(2)
      type(mode_terms_t), intent(inout) :: terms

      ! points of the circle
      complex(wp) :: s(2*half_circle)
      ! positions of the points relative to the centre
      complex(wp) :: arm(2*half_circle)
      ! Laplace transform of z at the points
      complex(wp) :: z(2*half_circle)
      complex(wp) :: load_exponent
      ! amplitude of the term with the conjugate exponent of the mode
      complex(wp) :: conjugate_term

      load_exponent = cmplx(0.0_wp, forced%frequency, wp)
      arm = radius_times_length/mode%length*direction
      s = 0.5_wp*(load_exponent + mode%exponent(1)) + arm
      conjugate_term = forced%force/((mode%exponent(2) - load_exponent)*(mode%exponent(2) - mode%exponent(1)))
      z = (forced%force/((s - load_exponent)*(s - mode%exponent(1))) - conjugate_term)/(s - mode%exponent(2))
      free_start = free_start + real(conjugate_term*[(1.0_wp, 0.0_wp), mode%exponent(2)], wp)
      call add_terms(s, arm/real(size(arm), wp)*z, 1.0_wp + mode%two_zeta*s, terms)
   end subroutine add_resonance

   !> Add the free motion.
   pure subroutine add_free_motion(mode, start, terms)
      type(single_mode_t), intent(in) :: mode
      !> Modal displacement z and velocity z' at the start
      real(wp), intent(in) :: start(2)
      type(mode_terms_t), intent(inout) :: terms

      ! positions of the points of a circle relative to its centre
      complex(wp) :: arm(half_circle)
      ! amplitude of the faster of two real exponents
      complex(wp) :: amplitude
      ! 1 + 2 zeta s at the exponents
      complex(wp) :: viscous(2)
      ! minus the centre of the circle
      real(wp) :: center
      ! radius of the circle
      real(wp) :: radius

      center = 0.5_wp*mode%damping
      radius = max(fraction_of_decay*center, radius_times_length/mode%length)
      if (mode%spread <= nearness*radius) then
         arm = radius*direction(:half_circle)
         ! `pole_square`: squared distance of the exponents from the centre, negative if they are complex
         associate (s => arm - center, pole_square => merge(-1.0_wp, 1.0_wp, mode%oscillates)*mode%spread**2)
            call add_terms(s, arm/real(half_circle, wp)*((arm + center)*start(1) + start(2))/(arm**2 - pole_square), &
               1.0_wp + mode%two_zeta*s, terms)
         end associate
         return
      end if
      ! 1 + 2 zeta s at the exponents, without cancellation
      viscous = 1.0_wp + mode%two_zeta*mode%exponent
      if (mode%square >= mode%mass_rate**2) viscous = -mode%exponent*(mode%exponent + mode%mass_rate)/mode%square
      if (mode%oscillates) then
         call add_terms(mode%exponent(1:1), [cmplx(start(1), -(start(2) + mode%decay*start(1))/mode%spread, wp)], &
            viscous(1:1), terms)
      else
         amplitude = -0.5_wp*(start(2) + mode%decay*start(1))/mode%spread
         call add_slower(mode, start(1) - amplitude, viscous(1), terms)
         call add_terms(mode%exponent(2:2), [amplitude], viscous(2:2), terms)
      end if
   end subroutine add_free_motion

   !> Add the term of the slower of two real exponents, which may be slow.
   pure subroutine add_slower(mode, amplitude, viscous, terms)
      type(single_mode_t), intent(in) :: mode
      complex(wp), intent(in) :: amplitude
      !> 1 + 2 zeta s at the exponent s
      complex(wp), intent(in) :: viscous
      type(mode_terms_t), intent(inout) :: terms

      complex(wp) :: s
      integer :: j

      if (mode%decay*mode%length > max_slow) then
         call add_terms(mode%exponent(1:1), [amplitude], [viscous], terms)
         return
      end if
      do j = 1, slow_points
         s = slow_radius/mode%length*slow_direction(j)
         terms%slow(:, j) = terms%slow(:, j) &
            + s/real(slow_points, wp)*amplitude/(s - mode%exponent(1))*[(1.0_wp, 0.0_wp), viscous]
      end do
   end subroutine add_slower

   !> Append terms.
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
