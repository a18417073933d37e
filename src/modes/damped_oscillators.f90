!> A family of damped oscillators z'' + (2 zeta W^2 + alpha) z' + W^2 z = 0: the modes of a beam whose damping is
!> proportional to its stiffness (zeta) and its mass (alpha), or is given mode by mode (alpha of each mode), which
!> is negative for a body whose damping ratio is less than zeta W. W is the natural frequency in omega1. Each oscillator
!> is propagated in closed form, without cancellation near critical damping.
module damped_oscillators
   use kinds, only: i8, wp
   implicit none (type, external)
   private
   public :: oscillators_t, make_oscillators, propagate, acceleration
   public :: propagate_lanes, find_decay_factors, find_oscillations, decay_integral, padded, lanes, max_exponent, &
      elastic_and_viscous
   public :: sampler_t, next_sample, modal_energy, damping_order

   type :: oscillators_t
      !> Number of oscillators
      integer :: count = 0
      !> 2 zeta
      real(wp) :: two_zeta = 0.0_wp
      !> W^2, underdamped oscillators first, then those up to `unseparated`, [count]
      real(wp), allocatable :: square(:)
      !> W, [count]
      real(wp), allocatable :: frequency(:)
      !> Oscillators 1 to `underdamped` are underdamped
      integer :: underdamped = 0
      !> Oscillators 1 to `unseparated` have exponents too near to each other to be separated; the others are far beyond
      !> critical damping
      integer :: unseparated = 0
      !> Decay rate. Underdamped: zeta W^2 + alpha/2; else: that of the slow exponent, W^2/(zeta W^2 + alpha/2 + spread)
      !> > 0, [count, then ones up to `padded`]
      real(wp), allocatable :: decay(:)
      !> Half the distance of the two exponents. Underdamped: W sqrt(1 - xi^2), the damped frequency; else: W sqrt(xi^2
      !> - 1), with xi the damping ratio, [as `decay`]
      real(wp), allocatable :: spread(:)
      !> Overdamped: decay rate of the fast exponent, decay + 2 spread, [as `decay`]
      real(wp), allocatable :: fast(:)
      !> Difference of both decay rates, 2 spread, up to `unseparated`, then `fast`, [as `decay`]
      real(wp), allocatable :: second(:)
      !> alpha of damping proportional to mass, or 2 xi W of damping given mode by mode; of a body, negative if its
      !> damper is weaker than 2 zeta W^2; padded with zeros, [as `decay`]
      real(wp), allocatable :: mass_rate(:)
      !> Overdamped: decay rate of the fast exponent less alpha, [as `decay`]
      real(wp), allocatable :: fast_excess(:)
      !> W^2, [as `decay`]
      real(wp), allocatable :: lane_square(:)
      !> 1/W^2, [as `decay`]
      real(wp), allocatable :: inverse_square(:)
      !> 1/spread, limited near critical damping so that its powers do not overflow, [as `decay`]
      real(wp), allocatable :: inverse_spread(:)
   end type oscillators_t

   !> Number of elements of a SIMD vector, the widest of today's processors.
   integer, parameter :: lanes = 8

   !> Damping ratio above which the two exponents, a factor of four or more apart, are separated.
   real(wp), parameter :: min_separated_ratio = 1.25_wp
   !> Decay rate above which the exponents are separated: two slow exponentials, with amplitudes velocity over rate,
   !> cancel. A body with a weak damper and no spring has such exponents.
   real(wp), parameter :: min_separated_rate = 1.0e-3_wp

   !> Limit of x in exp(-x): exp(-700) is negligible, but a normal number; processors are slow with subnormal numbers.
   real(wp), parameter :: max_exponent = 700.0_wp

   !> Number of steps after which the recurrence restarts from the closed form, so that rounding errors do not grow.
   integer, parameter :: renewal_interval = 64

   !> Samples the state at equal steps, phase by phase (a phase is the motion between two events).
   type :: sampler_t
      !> Displacements at the last sample, [count]
      real(wp), allocatable :: z(:)
      !> Velocities at the last sample, [count]
      real(wp), allocatable :: v(:)
      !> Steps since the last closed form; a phase starts with `renewal_interval` or more
      integer :: steps_since_renewal = renewal_interval
      !> Entries of the matrices of a step, from the state (z, v) to (a z + b v, c z + d v) in the order a, c, b, d,
      !> [count, 4]; unallocated: no step has been made
      real(wp), allocatable :: matrix(:, :)
   end type sampler_t

contains

   !> Prepare the closed forms of a family of oscillators.
   pure subroutine make_oscillators(square, zeta, oscillators, mass_rate)
      !> W^2 in units of omega1^2, > 0, in the order of `damping_order`
      real(wp), intent(in) :: square(:)
      !> zeta = gamma omega1/2 with gamma the coefficient of damping proportional to stiffness, >= 0
      real(wp), intent(in) :: zeta
      type(oscillators_t), intent(out) :: oscillators
      !> alpha/omega1, [modes]; default 0
      real(wp), intent(in), optional :: mass_rate(:)

      integer :: i
      real(wp) :: xi

      associate (n => size(square))
         oscillators%count = n
         oscillators%two_zeta = 2.0_wp*zeta
         allocate (oscillators%square, source=square)
         allocate (oscillators%frequency, source=sqrt(square))
         allocate (oscillators%decay(padded(n)), oscillators%spread(padded(n)), source=1.0_wp)
         allocate (oscillators%lane_square(padded(n)), oscillators%inverse_square(padded(n)), &
            oscillators%inverse_spread(padded(n)), source=1.0_wp)
         allocate (oscillators%fast_excess(padded(n)), source=0.0_wp)
         allocate (oscillators%mass_rate(padded(n)), source=0.0_wp)
         if (present(mass_rate)) oscillators%mass_rate(:n) = mass_rate
         oscillators%lane_square(:n) = square
         oscillators%inverse_square(:n) = 1.0_wp/square
         do i = 1, n
            xi = damping_ratio(zeta, oscillators%mass_rate(i), oscillators%frequency(i))
            if (xi < min_separated_ratio .or. xi*sqrt(square(i)) < min_separated_rate) oscillators%unseparated = i
            if (xi < 1.0_wp) then
               oscillators%underdamped = i
               ! the sum of an undamped body is a rounding error of either sign
               oscillators%decay(i) = max(zeta*square(i) + 0.5_wp*oscillators%mass_rate(i), 0.0_wp)
               oscillators%spread(i) = oscillators%frequency(i)*sqrt((1.0_wp - xi)*(1.0_wp + xi))
            else
               oscillators%spread(i) = oscillators%frequency(i)*sqrt((xi - 1.0_wp)*(xi + 1.0_wp))
               oscillators%decay(i) = square(i)/(zeta*square(i) + 0.5_wp*oscillators%mass_rate(i) &
                  + oscillators%spread(i))
               oscillators%fast_excess(i) = oscillators%decay(i) + 2.0_wp*oscillators%spread(i) &
                  - oscillators%mass_rate(i)
               ! For W < alpha the fast decay rate is almost alpha, and its difference from alpha would cancel
               if (oscillators%frequency(i) < oscillators%mass_rate(i)) then
                  oscillators%fast_excess(i) = oscillators%two_zeta*square(i) - oscillators%decay(i)
               end if
            end if
            oscillators%inverse_spread(i) = 1.0_wp/max(oscillators%spread(i), tiny(1.0_wp)**0.25_wp)
         end do
         allocate (oscillators%fast, source=oscillators%decay + 2.0_wp*oscillators%spread)
         allocate (oscillators%second, source=oscillators%fast)
         oscillators%second(:oscillators%unseparated) = 2.0_wp*oscillators%spread(:oscillators%unseparated)
      end associate
   end subroutine make_oscillators

   !> Damping ratio (fraction of critical damping) of a mode.
   elemental real(wp) function damping_ratio(zeta, mass_rate, frequency) result(ratio)
      real(wp), intent(in) :: zeta
      !> Rate alpha of damping proportional to mass
      real(wp), intent(in) :: mass_rate
      !> Frequency W
      real(wp), intent(in) :: frequency

      ratio = zeta*frequency
      if (abs(mass_rate) > 0.0_wp) ratio = ratio + 0.5_wp*mass_rate/frequency
   end function damping_ratio

   !> Order of the modes that the closed forms need: underdamped modes, modes near critical damping, modes far beyond
   !> critical damping, each group in its original order.
   pure function damping_order(square, zeta, mass_rate) result(order)
      !> W^2, [modes]
      real(wp), intent(in) :: square(:)
      real(wp), intent(in) :: zeta
      !> alpha, [modes]
      real(wp), intent(in) :: mass_rate(:)
      integer :: order(size(square))

      real(wp) :: ratio(size(square))
      integer :: i

      ratio = damping_ratio(zeta, mass_rate, sqrt(square))
      associate (is_underdamped => ratio < 1.0_wp, is_unseparated => ratio < min_separated_ratio .or. &
         ratio*sqrt(square) < min_separated_rate)
         order = [pack([(i, i=1, size(square))], is_underdamped), pack([(i, i=1, size(square))], &
            is_unseparated .and. .not. is_underdamped), pack([(i, i=1, size(square))], .not. is_unseparated)]
      end associate
   end function damping_order

   !> State after a time t.
   pure subroutine propagate(oscillators, t, z0, v0, z, v)
      type(oscillators_t), intent(in) :: oscillators
      !> Time, >= 0
      real(wp), intent(in) :: t
      !> Displacements at time 0, [count]
      real(wp), intent(in) :: z0(:)
      !> Velocities at time 0, [count]
      real(wp), intent(in) :: v0(:)
      !> Displacements at time t, [count]
      real(wp), intent(out) :: z(:)
      !> Velocities at time t, [count]
      real(wp), intent(out) :: v(:)

      real(wp), dimension(size(oscillators%decay)) :: lane_z0, lane_v0, lane_z, lane_v, factors

      associate (n => oscillators%count)
         lane_z0(n + 1:) = 0.0_wp
         lane_v0(n + 1:) = 0.0_wp
         lane_z0(:n) = z0
         lane_v0(:n) = v0
         call propagate_lanes(oscillators, n, t, lane_z0, lane_v0, lane_z, lane_v, factors)
         z = lane_z(:n)
         v = lane_v(:n)
      end associate
   end subroutine propagate

   !> `propagate` on whole SIMD vectors: all arrays are padded with zeros to `padded(count)`.
   pure subroutine propagate_lanes(oscillators, last, t, z0, v0, z, v, factors)
      type(oscillators_t), intent(in) :: oscillators
      !> Index of the last oscillator whose state is needed; later overdamped oscillators may keep their old states
      integer, intent(in) :: last
      !> Time, >= 0
      real(wp), intent(in) :: t
      !> Displacements at time 0, [padded]
      real(wp), contiguous, intent(in) :: z0(:)
      !> Velocities at time 0, [padded]
      real(wp), contiguous, intent(in) :: v0(:)
      !> Displacements at time t, [padded]
      real(wp), contiguous, intent(out) :: z(:)
      !> Velocities at time t, [padded]
      real(wp), contiguous, intent(out) :: v(:)
      !> exp(-decay t) of all oscillators, [padded]
      real(wp), contiguous, intent(out) :: factors(:)

      if (.not. t > 0.0_wp) then
         z = z0
         v = v0
         factors = 1.0_wp
         return
      end if
      call find_decay_factors(size(factors)/lanes, t, oscillators%decay, factors)
      if (oscillators%underdamped > 0) call propagate_underdamped(padded(oscillators%underdamped)/lanes, t, factors, &
         oscillators, z0, v0, z, v)
      if (oscillators%underdamped < min(size(z), last)) call propagate_overdamped( &
         lanes*(oscillators%underdamped/lanes), size(z)/lanes, t, factors, oscillators, z0, v0, z, v)
   end subroutine propagate_lanes

   !> Decay factors after a time, in whole SIMD vectors.
   pure subroutine find_decay_factors(blocks, t, decay, factors)
      !> Number of SIMD vectors in each array
      integer, intent(in) :: blocks
      real(wp), intent(in) :: t
      !> Decay rates
      real(wp), intent(in) :: decay(lanes*blocks)
      !> exp(-decay t)
      real(wp), intent(out) :: factors(lanes*blocks)

      ! each loop has one function, so that the compiler vectorises it
      !GCC$ builtin (exp) attributes simd (notinbranch) if('x86_64')
      integer :: i

      do i = 1, lanes*blocks
         factors(i) = exp(-min(decay(i)*t, max_exponent))
      end do
   end subroutine find_decay_factors

   !> Propagate underdamped modes. Overdamped modes of their last SIMD vector receive values without meaning.
   pure subroutine propagate_underdamped(blocks, t, factors, oscillators, z0, v0, z, v)
      !> Number of SIMD vectors with underdamped modes
      integer, intent(in) :: blocks
      !> Time, > 0
      real(wp), intent(in) :: t
      !> exp(-decay t)
      real(wp), intent(in) :: factors(lanes*blocks)
      type(oscillators_t), intent(in) :: oscillators
      !> Displacement at time 0
      real(wp), intent(in), dimension(lanes*blocks) :: z0
      !> Velocity at time 0
      real(wp), intent(in), dimension(lanes*blocks) :: v0
      !> Displacement at time t
      real(wp), intent(out), dimension(lanes*blocks) :: z
      !> Velocity at time t
      real(wp), intent(out), dimension(lanes*blocks) :: v

      real(wp), dimension(lanes*blocks) :: cosines, sines
      real(wp) :: decay
      integer :: b, i

      call find_oscillations(blocks, t, oscillators, cosines, sines)
      do b = 0, lanes*(blocks - 1), lanes
         !$omp simd private(decay)
         do i = b + 1, b + lanes
            decay = oscillators%decay(i)
            z(i) = factors(i)*(z0(i)*cosines(i) + (v0(i) + decay*z0(i))*sines(i))
            v(i) = factors(i)*(v0(i)*cosines(i) - (oscillators%lane_square(i)*z0(i) + decay*v0(i))*sines(i))
         end do
      end do
   end subroutine propagate_underdamped

   !> cos(w t) and sin(w t)/w with w the spread, in whole SIMD vectors.
   pure subroutine find_oscillations(blocks, t, oscillators, cosines, sines)
      !> Number of SIMD vectors
      integer, intent(in) :: blocks
      !> Time, > 0
      real(wp), intent(in) :: t
      type(oscillators_t), intent(in) :: oscillators
      !> cos(w t)
      real(wp), intent(out) :: cosines(lanes*blocks)
      !> sin(w t)/w, which tends to t as w tends to 0
      real(wp), intent(out) :: sines(lanes*blocks)

      !GCC$ builtin (sin) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (cos) attributes simd (notinbranch) if('x86_64')
      real(wp) :: angles(lanes*blocks)
      integer :: b, i

      do i = 1, lanes*blocks
         angles(i) = oscillators%spread(i)*t
      end do
      do i = 1, lanes*blocks
         cosines(i) = cos(angles(i))
      end do
      do i = 1, lanes*blocks
         sines(i) = sin(angles(i))
      end do
      do b = 0, lanes*(blocks - 1), lanes
         !$omp simd
         do i = b + 1, b + lanes
            sines(i) = merge(sines(i)*oscillators%inverse_spread(i), t, angles(i) > 1.0e-8_wp)
         end do
      end do
   end subroutine find_oscillations

   !> Propagate modes at and beyond critical damping. The first vector may contain underdamped modes, whose state at
   !> time t is already known.
   pure subroutine propagate_overdamped(before, blocks, t, factors, oscillators, z0, v0, z, v)
      !> Number of modes in the SIMD vectors before the first of these modes
      integer, intent(in) :: before
      !> Number of SIMD vectors in each array
      integer, intent(in) :: blocks
      !> Time, > 0
      real(wp), intent(in) :: t
      !> exp(-decay t)
      real(wp), intent(in) :: factors(lanes*blocks)
      type(oscillators_t), intent(in) :: oscillators
      !> Displacement at time 0
      real(wp), intent(in), dimension(lanes*blocks) :: z0
      !> Velocity at time 0
      real(wp), intent(in), dimension(lanes*blocks) :: v0
      !> Displacement at time t
      real(wp), intent(inout), dimension(lanes*blocks) :: z
      !> Velocity at time t
      real(wp), intent(inout), dimension(lanes*blocks) :: v

      !GCC$ builtin (exp) attributes simd (notinbranch) if('x86_64')
      ! exp(-2 s t), with s the spread
      real(wp), dimension(lanes*blocks) :: fast_factors
      ! ratio = (1 - exp(-2 s t))/(2 s), fast_velocity = v + decay z at time 0, y = new displacement
      real(wp) :: decay, ratio, fast_velocity, y
      ! as long as real numbers, so that both fill SIMD vectors alike
      integer(i8) :: b, first, i, last, underdamped

      first = int(before, i8)
      last = int(lanes*blocks, i8)
      do i = first + 1, last
         fast_factors(i) = exp(-min(2.0_wp*oscillators%spread(i)*t, max_exponent))
      end do
      underdamped = int(oscillators%underdamped, i8)
      do b = first, last - lanes, lanes
         !$omp simd private(decay, ratio, fast_velocity, y)
         do i = b + 1, b + lanes
            decay = oscillators%decay(i)
            ratio = decay_integral(2.0_wp*oscillators%spread(i)*t, fast_factors(i), t, oscillators%inverse_spread(i))
            ! Contains the fast exponential alone
            fast_velocity = v0(i) + decay*z0(i)
            y = factors(i)*(z0(i) + fast_velocity*ratio)
            ratio = factors(i)*fast_velocity*fast_factors(i) - decay*y
            z(i) = merge(y, z(i), i > underdamped)
            v(i) = merge(ratio, v(i), i > underdamped)
         end do
      end do
   end subroutine propagate_overdamped

   !> Integral (1 - exp(-2 s t))/(2 s) of exp(-2 s t) with s the spread of an overdamped mode; t if s = 0.
   elemental real(wp) function decay_integral(separation, fast_factor, t, inverse_spread) result(integral)
      !> 2 s t
      real(wp), intent(in) :: separation
      !> exp(-2 s t)
      real(wp), intent(in) :: fast_factor
      real(wp), intent(in) :: t
      !> 1/s
      real(wp), intent(in) :: inverse_spread

      ! sinh(x)/x in powers of x^2: 1/(2 k + 1)!
      real(wp), parameter :: hyperbolic(7) = 1.0_wp/[6.0_wp, 120.0_wp, 5040.0_wp, 362880.0_wp, 39916800.0_wp, &
         6227020800.0_wp, 1307674368000.0_wp]
      ! (s t)^2 in the series, then the value of the series
      real(wp) :: y

      ! t exp(-s t) sinh(s t)/(s t) near critical damping
      y = 0.25_wp*min(separation, 1.0_wp)**2
      y = t*sqrt(fast_factor)*(1.0_wp + y*(hyperbolic(1) + y*(hyperbolic(2) + y*(hyperbolic(3) &
         + y*(hyperbolic(4) + y*(hyperbolic(5) + y*(hyperbolic(6) + y*hyperbolic(7))))))))
      integral = merge(y, 0.5_wp*(1.0_wp - fast_factor)*inverse_spread, separation <= 1.0_wp)
   end function decay_integral

   !> The smallest multiple of `lanes` that is not below a number.
   elemental integer function padded(count) result(whole)
      !> The number, >= 0
      integer, intent(in) :: count

      whole = lanes*((count + lanes - 1)/lanes)
   end function padded

   !> z + 2 zeta z': the elastic and viscous force of each mode over W^2. Far beyond critical damping the
   !> two terms of the slow exponential cancel, so the sum is computed from the two exponentials; the rounding error of
   !> the fast exponential decays with it.
   pure function elastic_and_viscous(oscillators, z, v, t, z0, v0) result(value)
      type(oscillators_t), intent(in) :: oscillators
      !> Displacements at the instant, [count]
      real(wp), intent(in) :: z(:)
      !> Velocities at the instant, [count]
      real(wp), intent(in) :: v(:)
      !> Time since an earlier state, >= 0
      real(wp), intent(in) :: t
      !> Displacements of the earlier state, [count]
      real(wp), intent(in) :: z0(:)
      !> Velocities of the earlier state, [count]
      real(wp), intent(in) :: v0(:)
      real(wp) :: value(oscillators%count)

      ! decay rates of the slow and of the fast exponential
      real(wp) :: slow, fast
      ! amplitude of the fast exponential
      real(wp) :: fast_part
      integer :: i

      do i = 1, oscillators%unseparated
         value(i) = z(i) + oscillators%two_zeta*v(i)
      end do
      do i = oscillators%unseparated + 1, oscillators%count
         slow = oscillators%decay(i)
         fast = slow + 2.0_wp*oscillators%spread(i)
         fast_part = -0.5_wp*oscillators%inverse_spread(i)*(v0(i) + slow*z0(i))
         ! 1 - 2 zeta s = -s (s - alpha)/W^2 for both decay rates s
         value(i) = -oscillators%inverse_square(i)* &
            ((z0(i) - fast_part)*(slow*(slow - oscillators%mass_rate(i)))*exp(-min(slow*t, max_exponent)) &
            + fast_part*(fast*oscillators%fast_excess(i))*exp(-min(fast*t, max_exponent)))
      end do
   end function elastic_and_viscous

   !> z'' from the equation of motion.
   pure function acceleration(oscillators, z, v) result(a)
      type(oscillators_t), intent(in) :: oscillators
      !> Displacements, [count]
      real(wp), intent(in) :: z(:)
      !> Velocities, [count]
      real(wp), intent(in) :: v(:)
      real(wp) :: a(oscillators%count)

      a = -oscillators%square*(z + oscillators%two_zeta*v) - oscillators%mass_rate(:oscillators%count)*v
   end function acceleration

   !> Advance to the next sample: by one step from the last one or, when the recurrence restarts, by the closed form.
   pure subroutine next_sample(sampler, oscillators, z0, v0, step, time)
      type(sampler_t), intent(inout) :: sampler
      !> Oscillators of the phase
      type(oscillators_t), intent(in) :: oscillators
      !> Displacements at the start of the phase, [count]
      real(wp), intent(in) :: z0(:)
      !> Velocities at the start of the phase, [count]
      real(wp), intent(in) :: v0(:)
      !> Length of a step
      real(wp), intent(in) :: step
      !> Time since the start of the phase, >= 0
      real(wp), intent(in) :: time

      real(wp) :: zeros(size(z0)), ones(size(z0)), new
      integer :: i

      if (sampler%steps_since_renewal >= renewal_interval) then
         if (.not. allocated(sampler%z)) allocate (sampler%z(size(z0)), sampler%v(size(z0)))
         call propagate(oscillators, time, z0, v0, sampler%z, sampler%v)
         sampler%steps_since_renewal = 0
         return
      end if
      if (.not. allocated(sampler%matrix)) then
         allocate (sampler%matrix(size(z0), 4))
         zeros = 0.0_wp
         ones = 1.0_wp
         call propagate(oscillators, step, ones, zeros, sampler%matrix(:, 1), sampler%matrix(:, 2))
         call propagate(oscillators, step, zeros, ones, sampler%matrix(:, 3), sampler%matrix(:, 4))
      end if
      associate (m => sampler%matrix, z => sampler%z, v => sampler%v)
         do i = 1, size(z)
            new = m(i, 1)*z(i) + m(i, 3)*v(i)
            v(i) = m(i, 2)*z(i) + m(i, 4)*v(i)
            z(i) = new
         end do
      end associate
      sampler%steps_since_renewal = sampler%steps_since_renewal + 1
   end subroutine next_sample

   !> Kinetic energy and strain energy of all modes.
   pure function modal_energy(oscillators, z, v) result(energy)
      type(oscillators_t), intent(in) :: oscillators
      !> Displacements, [count]
      real(wp), intent(in), contiguous :: z(:)
      !> Velocities, [count]
      real(wp), intent(in), contiguous :: v(:)
      real(wp) :: energy(2)

      energy = 0.5_wp*[sum(v**2), sum(oscillators%square*z**2)]
   end function modal_energy

end module damped_oscillators
