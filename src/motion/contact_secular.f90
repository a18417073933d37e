!> The secular equation of the beam in contact with the three-element stop, and all its roots: the contact's exponents.
!>
!> With the free modes b_i at the stop and D_i(s) = s^2 + W_i^2 (1 + 2 zeta s), the exponents are the roots of
!>     1 + k (1 + beta s/(s + nu)) sum b_i^2/D_i(s) = 0,    nu = beta k/c.
!> They are found at once by the Ehrlich-Aberth iteration (Bini, Numer. Algorithms 13 (1996) 179), from
!> the modes of the beam with the stop's spring attached. Near s = -1/(2 zeta), where the heavily damped modes
!> crowd, differences of poles are taken in e = 1 + 2 zeta s, whose leading digits would be lost in s.
module contact_secular
   use constrained_modes, only: attach_spring
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: secular_t, make_secular, first_guess, find_all_roots, distances, inverses, secular, exponents, size_of
   public :: find_mode_poles, root_distances, sum_of_inverses

   !> The secular function, with its poles: of a weakly coupled mode the exponent lies so near to its pole that
   !> only their distance can carry the digits, so every root is kept as a pole and an offset.
   type :: secular_t
      integer :: modes = 0
      integer :: roots = 0
      integer :: poles = 0
      logical :: has_branch = .false.
      real(wp) :: two_zeta = 0.0_wp
      real(wp) :: stiffness = 0.0_wp
      real(wp) :: branch_stiffness = 0.0_wp
      real(wp) :: rate = 0.0_wp
      !> b_i^2 and W_i^2, [modes]
      real(wp), allocatable :: weight(:), square(:)
      !> Poles, and 1 + 2 zeta pole, [poles]
      complex(wp), allocatable :: pole(:), relative(:)
      !> The pole is one of those that crowd near -1/(2 zeta), [poles]
      logical, allocatable :: crowded(:)
   end type secular_t

contains

   !> The poles of the secular function: exponents of the free modes, pairs side by side, and of the branch.
   subroutine make_secular(beam, active, zeta, spring, problem)
      type(modal_beam_t), intent(in) :: beam
      !> Modes that move the stop point
      integer, intent(in) :: active(:)
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      class(impedance_t), intent(in) :: spring
      type(secular_t), intent(out) :: problem

      problem%modes = size(active)
      problem%has_branch = spring%branch_stiffness > 0.0_wp
      problem%roots = 2*size(active) + merge(1, 0, problem%has_branch)
      problem%poles = problem%roots
      problem%two_zeta = 2.0_wp*zeta
      problem%stiffness = spring%stiffness
      problem%branch_stiffness = spring%branch_stiffness
      problem%rate = spring%relaxation_rate
      allocate (problem%pole(problem%poles), problem%relative(problem%poles))
      allocate (problem%weight(size(active)), problem%square(size(active)))
      problem%weight(:) = beam%stop_value(active)**2
      problem%square(:) = beam%oscillators%square(active)
      call find_mode_poles(problem%square, zeta, problem%pole, problem%relative)
      if (problem%has_branch) then
         problem%pole(problem%poles) = -spring%relaxation_rate
         problem%relative(problem%poles) = 1.0_wp - problem%two_zeta*spring%relaxation_rate
      end if
      allocate (problem%crowded(problem%poles))
      problem%crowded(:) = problem%two_zeta > 0.0_wp .and. abs(problem%relative) < 0.5_wp
   end subroutine make_secular

   !> Exponents of the free modes, pairs side by side.
   pure subroutine find_mode_poles(squares, zeta, pole, relative, mass_rate)
      !> W_i^2, [modes]
      real(wp), intent(in) :: squares(:)
      real(wp), intent(in) :: zeta
      !> Them, and 1 + 2 zeta pole, [2 modes at least]
      complex(wp), intent(inout) :: pole(:)
      complex(wp), intent(inout) :: relative(:)
      !> alpha, [modes]; default 0
      real(wp), intent(in), optional :: mass_rate(:)

      integer :: i
      real(wp) :: damping, square

      if (present(mass_rate)) then
         if (any(mass_rate > 0.0_wp)) then
            call find_poles_with_mass(squares, zeta, mass_rate, pole, relative)
            return
         end if
      end if
      do i = 1, size(squares)
         square = squares(i)
         damping = 2.0_wp*zeta**2*square - 1.0_wp
         associate (p => pole(2*i - 1:2*i), e => relative(2*i - 1:2*i))
            if (damping > 1.0_wp) then
               ! the two values of e are each other's inverse
               e(1) = -1.0_wp/(damping + sqrt((damping - 1.0_wp)*(damping + 1.0_wp)))
               e(2) = 1.0_wp/e(1)
               p = (e - 1.0_wp)/(2.0_wp*zeta)
            else
               p(1) = cmplx(-zeta*square, &
                  sqrt(square)*sqrt((1.0_wp - zeta*sqrt(square))*(1.0_wp + zeta*sqrt(square))), wp)
               p(2) = conjg(p(1))
               e = 1.0_wp + 2.0_wp*zeta*p
            end if
         end associate
      end do
   end subroutine find_mode_poles

   !> The same with damping proportional to mass, or of each mode alone: s^2 + (2 zeta W^2 + alpha) s + W^2 = 0, so that
   !> 1 + 2 zeta s = -s (s + alpha)/W^2.
   pure subroutine find_poles_with_mass(squares, zeta, mass_rate, pole, relative)
      real(wp), intent(in) :: squares(:)
      real(wp), intent(in) :: zeta
      !> alpha, [modes]
      real(wp), intent(in) :: mass_rate(:)
      complex(wp), intent(inout) :: pole(:)
      complex(wp), intent(inout) :: relative(:)

      real(wp) :: decay, frequency, spread
      integer :: i

      do i = 1, size(squares)
         decay = zeta*squares(i) + 0.5_wp*mass_rate(i)
         frequency = sqrt(squares(i))
         associate (p => pole(2*i - 1:2*i), e => relative(2*i - 1:2*i))
            if (decay > frequency) then
               spread = sqrt((decay - frequency)*(decay + frequency))
               p = -cmplx([squares(i)/(decay + spread), decay + spread], 0.0_wp, wp)
               e = -p*(p + mass_rate(i))/squares(i)
               ! of a mode so slow that the faster pole is -alpha
               if (frequency < mass_rate(i)) e(2) = 1.0_wp + 2.0_wp*zeta*p(2)
            else
               p(1) = cmplx(-decay, sqrt((frequency - decay)*(frequency + decay)), wp)
               p(2) = conjg(p(1))
               e = 1.0_wp + 2.0_wp*zeta*p
            end if
         end associate
      end do
   end subroutine find_poles_with_mass

   !> Difference of two poles, without cancellation where both lie near -1/(2 zeta).
   elemental function pole_difference(problem, a, b) result(difference)
      type(secular_t), intent(in) :: problem
      !> Their numbers
      integer, intent(in) :: a
      integer, intent(in) :: b
      complex(wp) :: difference

      if (problem%crowded(a) .and. problem%crowded(b)) then
         difference = (problem%relative(a) - problem%relative(b))/problem%two_zeta
      else
         difference = problem%pole(a) - problem%pole(b)
      end if
   end function pole_difference

   !> s - pole for every pole.
   pure subroutine distances(problem, near, offset, distance)
      type(secular_t), intent(in) :: problem
      !> s lies at this pole
      integer, intent(in) :: near
      !> plus this offset
      complex(wp), intent(in) :: offset
      !> s - pole, [poles]
      complex(wp), intent(out) :: distance(:)

      integer :: j

      if (problem%crowded(near)) then
         do j = 1, problem%poles
            distance(j) = pole_difference(problem, near, j) + offset
         end do
      else
         do j = 1, problem%poles
            distance(j) = (problem%pole(near) - problem%pole(j)) + offset
         end do
      end if
   end subroutine distances

   !> Reciprocals of distances. Only the smallest can be so small that its square underflows.
   pure subroutine inverses(distance, inverse)
      !> s - pole, [poles]
      complex(wp), contiguous, intent(in) :: distance(:)
      !> 1/(s - pole), [poles]
      complex(wp), contiguous, intent(out) :: inverse(:)

      real(wp) :: square
      integer :: j

      do j = 1, size(distance)
         square = max(real(distance(j), wp)**2 + aimag(distance(j))**2, tiny(1.0_wp))
         inverse(j) = cmplx(real(distance(j), wp)/square, -aimag(distance(j))/square, wp)
      end do
      j = minloc(size_of(distance), dim=1)
      inverse(j) = 1.0_wp/distance(j)
   end subroutine inverses

   !> Exponents to start from: each mode of the beam with the spring attached keeps its share of the damping.
   subroutine first_guess(beam, active, zeta, spring, problem, near, offset)
      type(modal_beam_t), intent(in) :: beam
      !> Modes that move the stop point
      integer, intent(in) :: active(:)
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      class(impedance_t), intent(in) :: spring
      type(secular_t), intent(in) :: problem
      !> Guesses: the nearest pole, and the offset from it, [roots]
      integer, intent(out) :: near(:)
      complex(wp), intent(out) :: offset(:)

      complex(wp) :: s(size(near))
      real(wp), dimension(size(active)) :: square, at_stop
      real(wp) :: stiff, damping, root, share
      integer :: j

      stiff = spring%stiffness
      call attach_spring(problem%square, beam%stop_value(active), stiff, square, at_stop)
      if (problem%has_branch .and. sqrt(square(size(active))) > spring%relaxation_rate) then
         ! the branch is stiff for what is faster than it relaxes
         stiff = spring%stiffness + spring%branch_stiffness
         call attach_spring(problem%square, beam%stop_value(active), stiff, square, at_stop)
      end if
      near = [(j, j=1, size(near))]
      do j = 1, size(active)
         damping = zeta*max(square(j) - stiff*at_stop(j)**2, 0.0_wp)
         if (problem%has_branch) then
            share = spring%relaxation_rate**2/(spring%relaxation_rate**2 + square(j))
            damping = damping + 0.5_wp*spring%branch_stiffness*at_stop(j)**2*share/spring%relaxation_rate
         end if
         ! one root for both cases: where the loop becomes vectors neither may fail
         root = sqrt(abs(square(j) - damping**2))
         if (damping**2 < square(j)) then
            s(2*j - 1) = cmplx(-damping, root, wp)
            s(2*j) = conjg(s(2*j - 1))
         else
            root = damping + root
            s(2*j - 1) = -square(j)/root
            s(2*j) = -root
         end if
      end do
      if (problem%has_branch) then
         s(size(s)) = -spring%relaxation_rate*(1.0_wp + spring%stiffness*beam%flexibility)/ &
            (1.0_wp + (spring%stiffness + spring%branch_stiffness)*beam%flexibility)
      end if
      offset = s - problem%pole
      ! off the real axis, from where the iteration could not reach conjugate pairs, and off the poles
      do j = 1, size(s)
         if (problem%crowded(j)) then
            ! the slow exponent of a heavily damped mode hardly feels the stop
            offset(j) = 0.05_wp*problem%relative(j)/problem%two_zeta
         else if (abs(offset(j)) < 1.0e-3_wp*abs(problem%pole(j))) then
            offset(j) = offset(j) + 1.0e-3_wp*abs(problem%pole(j))
         end if
         if (.not. abs(aimag(problem%pole(j) + offset(j))) > 0.0_wp) then
            offset(j) = offset(j)*cmplx(1.0_wp, merge(0.3_wp, -0.3_wp, modulo(j, 2) == 0), wp)
         end if
      end do
   end subroutine first_guess

   !> Ehrlich-Aberth iteration on all roots at once.
   subroutine find_all_roots(problem, near, offset, converged)
      type(secular_t), intent(in) :: problem
      !> Roots: first guess in, roots out
      integer, intent(inout) :: near(:)
      complex(wp), intent(inout) :: offset(:)
      !> All values came down to rounding
      logical, intent(out) :: converged

      integer, parameter :: iteration_cap = 500
      complex(wp) :: value, slope, repulsion, step, s
      complex(wp), dimension(problem%poles) :: distance, inverse
      complex(wp), dimension(size(near)) :: apart
      logical :: done(size(near))
      integer :: iteration, m, j
      real(wp) :: noise, condition

      done = .false.
      do iteration = 1, iteration_cap
         do m = 1, size(near)
            if (done(m)) cycle
            call distances(problem, near(m), offset(m), distance)
            j = minloc(size_of(distance), dim=1)
            if (j /= near(m)) then
               near(m) = j
               offset(m) = distance(j)
            end if
            s = problem%pole(near(m)) + offset(m)
            call inverses(distance, inverse)
            call secular(problem, s, distance(problem%poles), inverse, value, slope, noise, condition)
            if (size_of(value) <= noise) then
               done(m) = .true.
               cycle
            end if
            ! the polynomial is the value times all D_i: its logarithmic derivative, less the other roots'
            repulsion = slope/value + sum(inverse(:2*problem%modes))
            call root_distances(problem, near, offset, m, apart)
            repulsion = repulsion - sum_of_inverses(apart)
            step = -1.0_wp/repulsion
            if (.not. size_of(step) <= huge(1.0_wp)) step = 1.0e-3_wp*offset(m)
            if (size_of(offset(m) + step) <= 1.0e-3_wp*size_of(offset(m))) then
               ! so much nearer to the pole that the difference would lose the digits
               offset(m) = weakly_coupled_offset(problem, near(m), s, distance)
            else
               offset(m) = offset(m) + step
            end if
            if (size_of(step) <= epsilon(1.0_wp)*size_of(offset(m))) done(m) = .true.
         end do
         if (all(done)) exit
      end do
      converged = all(done)
      if (.not. converged) return
      ! real roots exactly real
      do m = 1, size(near)
         s = problem%pole(near(m)) + offset(m)
         if (abs(aimag(problem%pole(near(m)))) > 0.0_wp) then
            if (abs(aimag(s)) <= 1.0e-12_wp*abs(s)) offset(m) = real(s, wp) - problem%pole(near(m))
         else if (abs(aimag(offset(m))) <= 1.0e-9_wp*abs(offset(m))) then
            offset(m) = real(offset(m), wp)
         end if
      end do
      converged = count(aimag(problem%pole(near) + offset) > 0.0_wp) == &
         count(aimag(problem%pole(near) + offset) < 0.0_wp)
   end subroutine find_all_roots

   !> The roots themselves. That of a branch that creeps lies so near to 0 that the offset from a pole has lost its
   !> digits: there s = -nu (1 + k G)/(1 + (1 + beta) k G), in which G = sum b_i^2/D_i(s) hardly changes.
   pure function exponents(problem, near, offset) result(s)
      type(secular_t), intent(in) :: problem
      !> Roots: pole and offset
      integer, intent(in) :: near(:)
      complex(wp), intent(in) :: offset(:)
      complex(wp) :: s(size(near))

      complex(wp) :: distance(problem%poles)
      real(wp) :: g
      integer :: m

      s = problem%pole(near) + offset
      if (.not. problem%has_branch) return
      do m = 1, size(near)
         if (size_of(s(m)) > 0.1_wp*size_of(problem%pole(near(m)))) cycle
         call distances(problem, near(m), offset(m), distance)
         associate (last => 2*problem%modes)
            g = sum(problem%weight/real(distance(1:last:2)*distance(2:last:2), wp))
         end associate
         s(m) = -problem%rate*(1.0_wp + problem%stiffness*g) &
            /(1.0_wp + (problem%stiffness + problem%branch_stiffness)*g)
      end do
   end function exponents

   !> Distances of one root from all others.
   pure subroutine root_distances(problem, near, offset, root, apart)
      type(secular_t), intent(in) :: problem
      !> Roots: pole and offset
      integer, intent(in) :: near(:)
      complex(wp), intent(in) :: offset(:)
      !> Which
      integer, intent(in) :: root
      !> Root less the others; of itself: 0, [roots]
      complex(wp), intent(out) :: apart(:)

      integer :: j

      if (problem%crowded(near(root))) then
         do j = 1, size(near)
            apart(j) = pole_difference(problem, near(root), near(j)) + (offset(root) - offset(j))
         end do
      else
         do j = 1, size(near)
            apart(j) = (problem%pole(near(root)) - problem%pole(near(j))) + (offset(root) - offset(j))
         end do
      end if
      apart(root) = (0.0_wp, 0.0_wp)
   end subroutine root_distances

   !> Sum of 1/z over all z but zeros.
   pure function sum_of_inverses(z) result(total)
      !> Numbers whose squares do not underflow, but for zeros
      complex(wp), intent(in) :: z(:)
      complex(wp) :: total

      real(wp) :: square, total_real, total_imaginary
      integer :: j

      total_real = 0.0_wp
      total_imaginary = 0.0_wp
      !$omp simd private(square) reduction(+:total_real, total_imaginary)
      do j = 1, size(z)
         square = max(real(z(j), wp)**2 + aimag(z(j))**2, tiny(1.0_wp))
         total_real = total_real + real(z(j), wp)/square
         total_imaginary = total_imaginary - aimag(z(j))/square
      end do
      total = cmplx(total_real, total_imaginary, wp)
   end function sum_of_inverses

   !> |Re z| + |Im z|: within sqrt(2) of |z|, without its square root.
   elemental function size_of(z) result(value)
      !> Number
      complex(wp), intent(in) :: z
      real(wp) :: value

      value = abs(real(z, wp)) + abs(aimag(z))
   end function size_of

   !> Offset of a root from its pole where the other poles are far: the pole's own term balances the rest.
   pure function weakly_coupled_offset(problem, near, s, distance) result(offset)
      type(secular_t), intent(in) :: problem
      !> The pole
      integer, intent(in) :: near
      !> Where the rest is evaluated, and its distances from the poles
      complex(wp), intent(in) :: s
      complex(wp), intent(in) :: distance(:)
      complex(wp) :: offset

      complex(wp) :: rest, numerator
      integer :: i, own

      own = (near + 1)/2
      rest = (0.0_wp, 0.0_wp)
      do i = 1, problem%modes
         if (i /= own) rest = rest + problem%weight(i)/(distance(2*i - 1)*distance(2*i))
      end do
      if (problem%has_branch) then
         if (own > problem%modes) then
            ! the spring's part of the numerator vanishes with the offset, and belongs to it
            offset = -problem%branch_stiffness*s*rest/(1.0_wp + problem%stiffness*rest)
            return
         end if
         numerator = problem%stiffness*distance(problem%poles) + problem%branch_stiffness*s
         rest = distance(problem%poles) + numerator*rest
      else
         numerator = problem%stiffness
         rest = 1.0_wp + numerator*rest
      end if
      ! the partner of pole 2 i - 1 is 2 i and the other way round
      offset = -numerator*problem%weight(own)/(rest*distance(merge(near + 1, near - 1, modulo(near, 2) == 1)))
   end function weakly_coupled_offset

   !> (s + nu) (1 + k (1 + beta s/(s + nu)) G(s)) and its derivative; without branch 1 + k G(s).
   pure subroutine secular(problem, s, from_branch, inverse, value, slope, noise, condition)
      type(secular_t), intent(in) :: problem
      !> Where
      complex(wp), intent(in) :: s
      !> Its distance from the last pole, the branch's if there is one
      complex(wp), intent(in) :: from_branch
      !> Inverses of its distances from the poles
      complex(wp), intent(in) :: inverse(:)
      !> Value and derivative
      complex(wp), intent(out) :: value
      complex(wp), intent(out) :: slope
      !> Rounding error of the value
      real(wp), intent(out) :: noise
      !> How much the sum for the derivative cancels, >= 1
      real(wp), intent(out) :: condition

      complex(wp) :: g, g_slope, d, numerator
      real(wp) :: size_of_slope, size_of_value
      integer :: i

      g = (0.0_wp, 0.0_wp)
      g_slope = (0.0_wp, 0.0_wp)
      size_of_slope = 0.0_wp
      size_of_value = 0.0_wp
      do i = 1, problem%modes
         d = problem%weight(i)*(inverse(2*i - 1)*inverse(2*i))
         g = g + d
         size_of_value = size_of_value + size_of(d)
         d = d*(inverse(2*i - 1) + inverse(2*i))
         g_slope = g_slope - d
         size_of_slope = size_of_slope + size_of(d)
      end do
      if (problem%has_branch) then
         associate (stiff => problem%stiffness + problem%branch_stiffness, shifted => from_branch)
            ! k (s + nu) + beta k s, where a weak branch would be lost in the sum of the stiffnesses
            numerator = problem%stiffness*shifted + problem%branch_stiffness*s
            value = shifted + numerator*g
            slope = 1.0_wp + stiff*g + numerator*g_slope
            size_of_slope = 1.0_wp + stiff*size_of(g) + size_of(numerator)*size_of_slope
            size_of_value = size_of(shifted) + (problem%stiffness*size_of(shifted) &
               + problem%branch_stiffness*size_of(s)) *size_of_value
         end associate
      else
         value = 1.0_wp + problem%stiffness*g
         slope = problem%stiffness*g_slope
         size_of_slope = problem%stiffness*size_of_slope
         size_of_value = 1.0_wp + problem%stiffness*size_of_value
      end if
      noise = 8.0_wp*epsilon(1.0_wp)*size_of_value
      condition = size_of_slope/max(size_of(slope), tiny(1.0_wp)*max(size_of_slope, 1.0_wp))
   end subroutine secular

end module contact_secular
