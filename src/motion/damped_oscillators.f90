!> A family of damped oscillators z'' + 2 zeta W^2 z' + W^2 z = 0, the modes of a beam whose damping is
!> proportional to its stiffness, each propagated in closed form: under-, critically and over-damped
!> without cancellation near critical damping.
module damped_oscillators
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: oscillators_t, make_oscillators, propagate, acceleration, step_matrices, step_matrices_t
   public :: apply_step

   type :: oscillators_t
      !> Number of oscillators
      integer :: count = 0
      !> 2 zeta
      real(wp) :: two_zeta = 0.0_wp
      !> W^2, ascending, [count]
      real(wp), allocatable :: square(:)
      !> W, [count]
      real(wp), allocatable :: frequency(:)
      !> The first of them are underdamped: 1 ... oscillating
      integer :: oscillating = 0
      !> Underdamped: decay zeta W^2; else the slow root's rate W^2/(a + s) > 0, [count]
      real(wp), allocatable :: decay(:)
      !> Underdamped: W sqrt(1 - xi^2); else s = W sqrt(xi^2 - 1), with xi = zeta W, [count]
      real(wp), allocatable :: spread(:)
   end type oscillators_t

   !> One step of fixed length: z+ = zz z + zv v, v+ = vz z + vv v.
   type :: step_matrices_t
      real(wp), allocatable :: zz(:), zv(:), vz(:), vv(:)
   end type step_matrices_t

contains

   !> Prepare the closed forms.
   pure subroutine make_oscillators(square, zeta, oscillators)
      !> W^2 in units of omega1^2, > 0, ascending
      real(wp), intent(in) :: square(:)
      !> zeta = gamma omega1/2, >= 0
      real(wp), intent(in) :: zeta
      !> The family
      type(oscillators_t), intent(out) :: oscillators

      integer :: i
      real(wp) :: xi

      associate (n => size(square))
         oscillators%count = n
         oscillators%two_zeta = 2.0_wp*zeta
         allocate (oscillators%square, source=square)
         allocate (oscillators%frequency, source=sqrt(square))
         allocate (oscillators%decay(n), oscillators%spread(n))
         do i = 1, n
            xi = zeta*oscillators%frequency(i)
            if (xi < 1.0_wp) then
               oscillators%oscillating = i
               oscillators%decay(i) = zeta*square(i)
               oscillators%spread(i) = oscillators%frequency(i)*sqrt((1.0_wp - xi)*(1.0_wp + xi))
            else
               oscillators%spread(i) = oscillators%frequency(i)*sqrt((xi - 1.0_wp)*(xi + 1.0_wp))
               oscillators%decay(i) = square(i)/(zeta*square(i) + oscillators%spread(i))
            end if
         end do
      end associate
   end subroutine make_oscillators

   !> State after a time t.
   pure subroutine propagate(oscillators, t, z0, v0, z, v)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> Time, >= 0
      real(wp), intent(in) :: t
      !> State at time 0, [count]
      real(wp), intent(in) :: z0(:)
      real(wp), intent(in) :: v0(:)
      !> State at time t, [count]
      real(wp), intent(out) :: z(:)
      real(wp), intent(out) :: v(:)

      ! short loops of one function each: the compiler makes vector calls of them
      !GCC$ builtin (exp) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (sin) attributes simd (notinbranch) if('x86_64')
      !GCC$ builtin (cos) attributes simd (notinbranch) if('x86_64')
      real(wp), dimension(oscillators%oscillating) :: factors, cosines, sines
      real(wp) :: factor, cosine, sine, phase, lag
      integer :: i

      do i = 1, oscillators%oscillating
         factors(i) = exp(-oscillators%decay(i)*t)
      end do
      do i = 1, oscillators%oscillating
         cosines(i) = cos(oscillators%spread(i)*t)
      end do
      do i = 1, oscillators%oscillating
         sines(i) = sin(oscillators%spread(i)*t)
      end do
      do i = 1, oscillators%oscillating
         ! sin(w t)/w, which is t where w vanishes
         phase = oscillators%spread(i)*t
         sine = merge(sines(i)/max(oscillators%spread(i), tiny(1.0_wp)), t, phase > 1.0e-8_wp)
         z(i) = factors(i)*(z0(i)*cosines(i) + (v0(i) + oscillators%decay(i)*z0(i))*sine)
         v(i) = factors(i)*(v0(i)*cosines(i) - (oscillators%square(i)*z0(i) + oscillators%decay(i)*v0(i))*sine)
      end do
      do i = oscillators%oscillating + 1, oscillators%count
         factor = exp(-oscillators%decay(i)*t)
         phase = 2.0_wp*oscillators%spread(i)*t
         ! (1 - exp(-2 s t))/(2 s), which is t where s vanishes
         if (phase > 1.0_wp) then
            cosine = exp(-phase)
            lag = (1.0_wp - cosine)/(2.0_wp*oscillators%spread(i))
         else
            lag = t*one_minus_exponential(phase)
            cosine = 1.0_wp - 2.0_wp*oscillators%spread(i)*lag
         end if
         sine = v0(i) + oscillators%decay(i)*z0(i)
         z(i) = factor*(z0(i) + sine*lag)
         v(i) = factor*sine*cosine - oscillators%decay(i)*z(i)
      end do
   end subroutine propagate

   !> (1 - exp(-x))/x for 0 <= x <= 1 by its series, to rounding.
   elemental function one_minus_exponential(x) result(value)
      !> Argument, 0 to 1
      real(wp), intent(in) :: x
      real(wp) :: value

      integer :: k
      real(wp) :: term

      value = 1.0_wp
      term = 1.0_wp
      do k = 2, 20
         term = -term*x/real(k, wp)
         value = value + term
         if (abs(term) < 0.25_wp*epsilon(1.0_wp)) exit
      end do
   end function one_minus_exponential

   !> z'' from the equation of motion.
   pure function acceleration(oscillators, z, v) result(a)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> State, [count]
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      real(wp) :: a(oscillators%count)

      a = -oscillators%square*(z + oscillators%two_zeta*v)
   end function acceleration

   !> The 2 x 2 matrices of one step of length h.
   pure subroutine step_matrices(oscillators, h, matrices)
      !> The family
      type(oscillators_t), intent(in) :: oscillators
      !> Length of the step
      real(wp), intent(in) :: h
      !> The matrices
      type(step_matrices_t), intent(out) :: matrices

      real(wp) :: zero(oscillators%count), one(oscillators%count)

      zero = 0.0_wp
      one = 1.0_wp
      associate (n => oscillators%count)
         allocate (matrices%zz(n), matrices%zv(n), matrices%vz(n), matrices%vv(n))
      end associate
      call propagate(oscillators, h, one, zero, matrices%zz, matrices%vz)
      call propagate(oscillators, h, zero, one, matrices%zv, matrices%vv)
   end subroutine step_matrices

   !> Advance a state by one step.
   pure subroutine apply_step(matrices, z, v)
      !> From `step_matrices`
      type(step_matrices_t), intent(in) :: matrices
      !> State
      real(wp), intent(inout) :: z(:)
      real(wp), intent(inout) :: v(:)

      integer :: i
      real(wp) :: new

      do i = 1, size(z)
         new = matrices%zz(i)*z(i) + matrices%zv(i)*v(i)
         v(i) = matrices%vz(i)*z(i) + matrices%vv(i)*v(i)
         z(i) = new
      end do
   end subroutine apply_step

end module damped_oscillators
