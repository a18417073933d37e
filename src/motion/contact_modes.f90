!> The beam in contact with the three-element stop: its natural exponents, found from the secular equation.
!>
!> With the free modes b_i at the stop and D_i(s) = s^2 + W_i^2 (1 + 2 zeta s), the exponents are the roots of
!>     1 + k (1 + beta s/(s + nu)) sum b_i^2/D_i(s) = 0,    nu = beta k/c,
!> and everything that moves is a sum of exp(s t) over them, its amplitudes the residues of the Laplace transform.
!> All roots are found at once by the Ehrlich-Aberth iteration (Bini, Numer. Algorithms 13 (1996) 179), from
!> the modes of the beam with the stop's spring attached. Near s = -1/(2 zeta), where the heavily damped modes
!> crowd, differences of poles are taken in e = 1 + 2 zeta s, whose leading digits would be lost in s.
module contact_modes
   use damped_oscillators, only: propagate
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use modal_beam, only: attach_spring, modal_beam_t
   use stop_models, only: three_element_t
   implicit none (type, external)
   private
   public :: contact_modes_t, make_contact_modes, contact_amplitudes, contact_state
   public :: contact_losses_t, make_contact_losses, contact_losses

   !> Modes whose value at the stop is below this share of the greatest do not feel it.
   real(wp), parameter :: least_coupling = 1.0e-100_wp

   !> Above this condition two exponents are taken together.
   real(wp), parameter :: greatest_condition = 1.0e3_wp

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
   end type secular_t

   type :: contact_modes_t
      logical :: made = .false.
      !> Number of exponents; of a conjugate pair only the one with Im s > 0 is kept
      integer :: count = 0
      !> Exponents s, [count]
      complex(wp), allocatable :: exponent(:)
      !> 1 for a real exponent, 2 for a conjugate pair, [count]
      real(wp), allocatable :: weight(:)
      !> d/ds of (s + nu) (1 + ...) at the root, [count]
      complex(wp), allocatable :: derivative(:)
      !> b_i/D_i(s): displacement of free mode i per unit of P, [free, count]
      complex(wp), allocatable :: shape(:, :)
      !> Free modes with a node at the stop: they swing on as if alone
      integer, allocatable :: inactive(:)
      !> Stop point and tip per unit of P, [count]
      complex(wp), allocatable :: stop_value(:)
      complex(wp), allocatable :: tip_value(:)
      !> The tip in the static shape of P = 1
      real(wp) :: static_tip = 0.0_wp
      !> Condition of each exponent: 1 for well separated ones, infinite where two coalesce, [count]
      real(wp), allocatable :: condition(:)
   end type contact_modes_t

   !> Dissipation per pair of exponents: power = Re sum (plain A_m A_n + conjugate A_m conj(A_n))/2, [count, count].
   type :: contact_losses_t
      !> In the beam: 2 zeta sum W_i^2 v_i^2
      complex(wp), allocatable :: beam_plain(:, :), beam_conjugate(:, :)
      !> In the damper: nu P2^2/(beta k)
      complex(wp), allocatable :: stop_plain(:, :), stop_conjugate(:, :)
   end type contact_losses_t

contains

   !> Find all exponents.
   subroutine make_contact_modes(beam, zeta, spring, modes, error)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> The exponents and their shapes
      type(contact_modes_t), intent(out) :: modes
      !> Set when the iteration does not converge
      type(failure_t), allocatable, intent(inout) :: error

      type(secular_t) :: problem
      integer, allocatable :: active(:), near(:), keep(:)
      complex(wp), allocatable :: offset(:), distance(:), s(:)
      integer :: i, m, n
      complex(wp) :: value, slope
      real(wp) :: noise
      logical :: converged

      associate (b => abs(beam%stop_value))
         allocate (active, source=pack([(i, i=1, beam%count)], b > least_coupling*maxval(b)))
         allocate (modes%inactive, source=pack([(i, i=1, beam%count)], b <= least_coupling*maxval(b)))
      end associate
      call make_secular(beam, active, zeta, spring, problem)
      n = problem%roots
      allocate (near(n), offset(n), s(n), distance(problem%poles))
      call first_guess(beam, active, zeta, spring, problem, near, offset)
      call find_all_roots(problem, near, offset, converged)
      if (.not. converged) then
         call fail(error, status_run_failed, 'the exponents of the contact with the three-element stop were not found')
         return
      end if
      s(:) = problem%pole(near) + offset
      allocate (keep, source=pack([(i, i=1, n)], aimag(s) >= 0.0_wp))
      modes%made = .true.
      modes%count = size(keep)
      allocate (modes%exponent(modes%count), modes%weight(modes%count), modes%derivative(modes%count))
      allocate (modes%condition(modes%count), modes%shape(beam%count, modes%count))
      allocate (modes%stop_value(modes%count), modes%tip_value(modes%count))
      modes%exponent(:) = s(keep)
      modes%weight = merge(2.0_wp, 1.0_wp, aimag(modes%exponent) > 0.0_wp)
      modes%shape = (0.0_wp, 0.0_wp)
      do m = 1, modes%count
         call distances(problem, near(keep(m)), offset(keep(m)), distance)
         do i = 1, size(active)
            modes%shape(active(i), m) = beam%stop_value(active(i))/(distance(2*i - 1)*distance(2*i))
         end do
         call secular(problem, modes%exponent(m), distance, value, slope, noise, modes%condition(m))
         modes%derivative(m) = slope
         modes%stop_value(m) = sum(beam%stop_value*modes%shape(:, m))
         modes%tip_value(m) = sum(beam%tip_value*modes%shape(:, m))
      end do
      if (any(modes%condition > greatest_condition)) call replace_clusters(beam, problem, active, s, keep, modes)
      modes%static_tip = sum(beam%tip_value*beam%stop_value/beam%oscillators%square)
      if (beam%stop_is_tip) modes%static_tip = beam%flexibility
   end subroutine make_contact_modes

   !> Two exponents that nearly coalesce have large amplitudes that cancel. Their sum is the integral of the Laplace
   !> transform over a circle around both, where nothing is large: by the trapezoidal rule, which converges
   !> geometrically there, the points of the circle take the place of the two exponents
   !> (Trefethen and Weideman, SIAM Rev. 56 (2014) 385).
   subroutine replace_clusters(beam, problem, active, s, keep, modes)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> The secular function
      type(secular_t), intent(in) :: problem
      !> Modes that move the stop point
      integer, intent(in) :: active(:)
      !> All exponents, and which of them `modes` has
      complex(wp), intent(in) :: s(:)
      integer, intent(in) :: keep(:)
      !> Clusters are replaced
      type(contact_modes_t), intent(inout) :: modes

      integer, parameter :: points = 48
      type(contact_modes_t) :: circles
      complex(wp) :: center, direction, node, value, slope, distance(problem%poles)
      real(wp) :: apart, room, radius, noise, angle
      logical :: gone(size(keep)), on_axis
      integer :: m, i, k, partner, near, place

      gone = .false.
      call make_room(circles, beam%count, (points + 1)*size(keep))
      do m = 1, size(keep)
         if (gone(m) .or. modes%condition(m) <= greatest_condition) cycle
         partner = minloc(abs(s - s(keep(m))), dim=1, mask=[(i, i=1, size(s))] /= keep(m))
         center = 0.5_wp*(s(keep(m)) + s(partner))
         apart = abs(s(keep(m)) - s(partner))
         on_axis = abs(aimag(center)) <= apart
         if (on_axis) center = real(center, wp)
         room = minval(abs(s - center), mask=[(i, i=1, size(s))] /= keep(m) .and. [(i, i=1, size(s))] /= partner)
         room = min(room, minval(abs(problem%pole - center)))
         ! inside the half plane of decay, far from everything else
         radius = min(0.3_wp*abs(real(center, wp)), 0.3_wp*room)
         if (radius < 2.5_wp*apart) cycle
         gone(m) = .true.
         do i = 1, size(keep)
            if (keep(i) == partner) gone(i) = .true.
         end do
         do k = 1, points
            angle = 2.0_wp*acos(-1.0_wp)*(real(k, wp) - 0.5_wp)/real(points, wp)
            ! around the real axis the lower half is the conjugate of the upper one
            if (on_axis .and. k > points/2) exit
            direction = cmplx(cos(angle), sin(angle), wp)
            node = center + radius*direction
            near = minloc(abs(problem%pole - node), dim=1)
            call distances(problem, near, node - problem%pole(near), distance)
            place = circles%count + 1
            circles%count = place
            call secular(problem, node, distance, value, slope, noise, circles%condition(place))
            circles%condition(place) = 1.0_wp
            circles%exponent(place) = node
            circles%weight(place) = 2.0_wp
            circles%derivative(place) = value*real(points, wp)/(radius*direction)
            do i = 1, size(active)
               circles%shape(active(i), place) = beam%stop_value(active(i))/(distance(2*i - 1)*distance(2*i))
            end do
            circles%stop_value(place) = sum(beam%stop_value*circles%shape(:, place))
            circles%tip_value(place) = sum(beam%tip_value*circles%shape(:, place))
         end do
      end do
      if (.not. any(gone)) return
      do m = 1, size(keep)
         if (gone(m)) cycle
         place = circles%count + 1
         circles%count = place
         circles%exponent(place) = modes%exponent(m)
         circles%weight(place) = modes%weight(m)
         circles%derivative(place) = modes%derivative(m)
         circles%condition(place) = modes%condition(m)
         circles%shape(:, place) = modes%shape(:, m)
         circles%stop_value(place) = modes%stop_value(m)
         circles%tip_value(place) = modes%tip_value(m)
      end do
      associate (all => circles%count)
         modes%count = all
         modes%exponent = circles%exponent(:all)
         modes%weight = circles%weight(:all)
         modes%derivative = circles%derivative(:all)
         modes%condition = circles%condition(:all)
         modes%shape = circles%shape(:, :all)
         modes%stop_value = circles%stop_value(:all)
         modes%tip_value = circles%tip_value(:all)
      end associate
   end subroutine replace_clusters

   !> Room for some exponents.
   pure subroutine make_room(modes, free, most)
      !> Nothing in it yet
      type(contact_modes_t), intent(inout) :: modes
      !> Number of free modes, and of exponents at most
      integer, intent(in) :: free
      integer, intent(in) :: most

      allocate (modes%exponent(most), modes%weight(most), modes%derivative(most), modes%condition(most))
      allocate (modes%shape(free, most), modes%stop_value(most), modes%tip_value(most))
      modes%shape = (0.0_wp, 0.0_wp)
   end subroutine make_room

   !> The poles of the secular function: exponents of the free modes, pairs side by side, and of the branch.
   subroutine make_secular(beam, active, zeta, spring, problem)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Modes that move the stop point
      integer, intent(in) :: active(:)
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> The problem
      type(secular_t), intent(out) :: problem

      integer :: i
      real(wp) :: damping, square

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
      do i = 1, size(active)
         square = problem%square(i)
         damping = 2.0_wp*zeta**2*square - 1.0_wp
         associate (p => problem%pole(2*i - 1:2*i), e => problem%relative(2*i - 1:2*i))
            if (damping > 1.0_wp) then
               ! the two values of e are each other's inverse
               e(1) = -1.0_wp/(damping + sqrt((damping - 1.0_wp)*(damping + 1.0_wp)))
               e(2) = 1.0_wp/e(1)
               p = (e - 1.0_wp)/problem%two_zeta
            else
               p(1) = cmplx(-zeta*square, sqrt(square)*sqrt((1.0_wp - zeta*sqrt(square))*(1.0_wp + zeta*sqrt(square))), wp)
               p(2) = conjg(p(1))
               e = 1.0_wp + problem%two_zeta*p
            end if
         end associate
      end do
      if (problem%has_branch) then
         problem%pole(problem%poles) = -spring%relaxation_rate
         problem%relative(problem%poles) = 1.0_wp - problem%two_zeta*spring%relaxation_rate
      end if
   end subroutine make_secular

   !> Difference of two poles, without cancellation where both lie near -1/(2 zeta).
   elemental function pole_difference(problem, a, b) result(difference)
      !> The problem
      type(secular_t), intent(in) :: problem
      !> Their numbers
      integer, intent(in) :: a
      integer, intent(in) :: b
      complex(wp) :: difference

      if (problem%two_zeta > 0.0_wp .and. abs(problem%relative(a)) < 0.5_wp .and. abs(problem%relative(b)) < 0.5_wp) then
         difference = (problem%relative(a) - problem%relative(b))/problem%two_zeta
      else
         difference = problem%pole(a) - problem%pole(b)
      end if
   end function pole_difference

   !> s - pole for every pole.
   pure subroutine distances(problem, near, offset, distance)
      !> The problem
      type(secular_t), intent(in) :: problem
      !> s lies at this pole
      integer, intent(in) :: near
      !> plus this offset
      complex(wp), intent(in) :: offset
      !> s - pole, [poles]
      complex(wp), intent(out) :: distance(:)

      integer :: j

      do j = 1, problem%poles
         distance(j) = pole_difference(problem, near, j) + offset
      end do
   end subroutine distances

   !> Exponents to start from: each mode of the beam with the spring attached keeps its share of the damping.
   subroutine first_guess(beam, active, zeta, spring, problem, near, offset)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Modes that move the stop point
      integer, intent(in) :: active(:)
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> The problem
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
         if (damping**2 < square(j)) then
            root = sqrt(square(j) - damping**2)
            s(2*j - 1) = cmplx(-damping, root, wp)
            s(2*j) = conjg(s(2*j - 1))
         else
            root = damping + sqrt(damping**2 - square(j))
            s(2*j - 1) = -square(j)/root
            s(2*j) = -root
         end if
      end do
      if (problem%has_branch) &
         s(size(s)) = -spring%relaxation_rate*(1.0_wp + spring%stiffness*beam%flexibility)/ &
                      (1.0_wp + (spring%stiffness + spring%branch_stiffness)*beam%flexibility)
      offset = s - problem%pole
      ! off the real axis, from where the iteration could not reach conjugate pairs, and off the poles
      do j = 1, size(s)
         if (abs(problem%relative(j)) < 0.5_wp .and. problem%two_zeta > 0.0_wp) then
            ! the slow exponent of a heavily damped mode hardly feels the stop
            offset(j) = 0.05_wp*problem%relative(j)/problem%two_zeta
         else if (abs(offset(j)) < 1.0e-3_wp*abs(problem%pole(j))) then
            offset(j) = offset(j) + 1.0e-3_wp*abs(problem%pole(j))
         end if
         if (.not. abs(aimag(problem%pole(j) + offset(j))) > 0.0_wp) &
            offset(j) = offset(j)*cmplx(1.0_wp, merge(0.3_wp, -0.3_wp, modulo(j, 2) == 0), wp)
      end do
   end subroutine first_guess

   !> Ehrlich-Aberth iteration on all roots at once.
   subroutine find_all_roots(problem, near, offset, converged)
      !> The problem
      type(secular_t), intent(in) :: problem
      !> Roots: first guess in, roots out
      integer, intent(inout) :: near(:)
      complex(wp), intent(inout) :: offset(:)
      !> All values came down to rounding
      logical, intent(out) :: converged

      integer, parameter :: iteration_cap = 500
      complex(wp) :: value, slope, repulsion, step, distance(problem%poles), s
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
            call secular(problem, s, distance, value, slope, noise, condition)
            if (size_of(value) <= noise) then
               done(m) = .true.
               cycle
            end if
            ! the polynomial is the value times all D_i: its logarithmic derivative, less the other roots'
            repulsion = slope/value
            do j = 1, 2*problem%modes
               repulsion = repulsion + 1.0_wp/distance(j)
            end do
            do j = 1, size(near)
               if (j == m) cycle
               repulsion = repulsion - 1.0_wp/(pole_difference(problem, near(m), near(j)) + (offset(m) - offset(j)))
            end do
            step = -1.0_wp/repulsion
            if (.not. abs(step) <= huge(1.0_wp)) step = 1.0e-3_wp*offset(m)
            if (abs(offset(m) + step) <= 1.0e-3_wp*abs(offset(m))) then
               ! so much nearer to the pole that the difference would lose the digits
               offset(m) = weakly_coupled_offset(problem, near(m), s, distance)
            else
               offset(m) = offset(m) + step
            end if
            if (abs(step) <= epsilon(1.0_wp)*abs(offset(m))) done(m) = .true.
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
      converged = count(aimag(problem%pole(near) + offset) > 0.0_wp) == count(aimag(problem%pole(near) + offset) < 0.0_wp)
   end subroutine find_all_roots

   !> |Re z| + |Im z|: within sqrt(2) of |z|, without its square root.
   elemental function size_of(z) result(value)
      !> Number
      complex(wp), intent(in) :: z
      real(wp) :: value

      value = abs(real(z, wp)) + abs(aimag(z))
   end function size_of

   !> Offset of a root from its pole where the other poles are far: the pole's own term balances the rest.
   pure function weakly_coupled_offset(problem, near, s, distance) result(offset)
      !> The problem
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
         numerator = (problem%stiffness + problem%branch_stiffness)*s + problem%stiffness*problem%rate
         rest = numerator*rest
         if (own > problem%modes) then
            offset = -rest
            return
         end if
         rest = rest + distance(problem%poles)
      else
         numerator = problem%stiffness
         rest = 1.0_wp + numerator*rest
      end if
      ! the partner of pole 2 i - 1 is 2 i and the other way round
      offset = -numerator*problem%weight(own)/(rest*distance(merge(near + 1, near - 1, modulo(near, 2) == 1)))
   end function weakly_coupled_offset

   !> (s + nu) (1 + k (1 + beta s/(s + nu)) G(s)) and its derivative; without branch 1 + k G(s).
   pure subroutine secular(problem, s, distance, value, slope, noise, condition)
      !> The problem
      type(secular_t), intent(in) :: problem
      !> Where
      complex(wp), intent(in) :: s
      !> Its distances from the poles
      complex(wp), intent(in) :: distance(:)
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
         d = problem%weight(i)/(distance(2*i - 1)*distance(2*i))
         g = g + d
         size_of_value = size_of_value + size_of(d)
         d = d*(1.0_wp/distance(2*i - 1) + 1.0_wp/distance(2*i))
         g_slope = g_slope - d
         size_of_slope = size_of_slope + size_of(d)
      end do
      if (problem%has_branch) then
         associate (stiff => problem%stiffness + problem%branch_stiffness, shifted => distance(problem%poles))
            numerator = stiff*s + problem%stiffness*problem%rate
            value = shifted + numerator*g
            slope = 1.0_wp + stiff*g + numerator*g_slope
            size_of_slope = 1.0_wp + stiff*size_of(g) + size_of(numerator)*size_of_slope
            size_of_value = size_of(shifted) + (stiff*size_of(s) + problem%stiffness*problem%rate)*size_of_value
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

   !> Amplitudes c of P(t) = P_static + sum weight Re(c exp(s t)) from the state at the start of a contact.
   pure subroutine contact_amplitudes(beam, zeta, spring, modes, surface, q, v, branch_force, static_force, amplitude)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> Its exponents
      type(contact_modes_t), intent(in) :: modes
      !> delta
      real(wp), intent(in) :: surface
      !> Modal state
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      !> P2, the force in the branch
      real(wp), intent(in) :: branch_force
      !> The force that remains
      real(wp), intent(out) :: static_force
      !> c, [modes%count]
      complex(wp), intent(out) :: amplitude(:)

      real(wp) :: indentation
      complex(wp) :: start, forcing
      integer :: m

      indentation = surface - sum(beam%stop_value*q)
      static_force = spring%stiffness*surface/(1.0_wp + spring%stiffness*beam%flexibility)
      do m = 1, modes%count
         associate (s => modes%exponent(m))
            ! the free motion of the stop point, transformed
            start = sum(modes%shape(:, m)*((s + 2.0_wp*zeta*beam%oscillators%square)*q + v))
            forcing = surface/s - start
            if (spring%branch_stiffness > 0.0_wp) then
               forcing = forcing*((spring%stiffness + spring%branch_stiffness)*s &
                                  + spring%stiffness*spring%relaxation_rate) &
                         + branch_force - spring%branch_stiffness*indentation
            else
               forcing = spring%stiffness*forcing
            end if
            amplitude(m) = forcing/modes%derivative(m)
         end associate
      end do
   end subroutine contact_amplitudes

   !> Modal state at a time after the start of a contact.
   pure subroutine contact_state(beam, modes, static_force, amplitude, q0, v0, t, q, v)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> From `contact_amplitudes`
      real(wp), intent(in) :: static_force
      complex(wp), intent(in) :: amplitude(:)
      !> Modal state at the start; only the modes with a node at the stop are read
      real(wp), intent(in) :: q0(:)
      real(wp), intent(in) :: v0(:)
      !> Time
      real(wp), intent(in) :: t
      !> Modal state
      real(wp), intent(out) :: q(:)
      real(wp), intent(out) :: v(:)

      complex(wp) :: factor
      real(wp), dimension(size(q0)) :: alone, alone_rate
      integer :: m

      q = beam%stop_value/beam%oscillators%square*static_force
      v = 0.0_wp
      do m = 1, modes%count
         factor = modes%weight(m)*amplitude(m)*exp(modes%exponent(m)*t)
         q = q + real(factor*modes%shape(:, m), wp)
         v = v + real(factor*modes%exponent(m)*modes%shape(:, m), wp)
      end do
      if (size(modes%inactive) == 0) return
      call propagate(beam%oscillators, t, q0, v0, alone, alone_rate)
      q(modes%inactive) = alone(modes%inactive)
      v(modes%inactive) = alone_rate(modes%inactive)
   end subroutine contact_state

   !> What the ledger needs of each pair of exponents.
   pure subroutine make_contact_losses(beam, zeta, spring, modes, losses)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> zeta
      real(wp), intent(in) :: zeta
      !> The stop
      type(three_element_t), intent(in) :: spring
      !> Exponents and shapes
      type(contact_modes_t), intent(in) :: modes
      !> The pairs
      type(contact_losses_t), intent(out) :: losses

      complex(wp) :: rate(beam%count, modes%count), branch(modes%count)
      real(wp) :: factor
      integer :: m, n

      associate (k => modes%count)
         allocate (losses%beam_plain(k, k), losses%beam_conjugate(k, k), losses%stop_plain(k, k), &
                   losses%stop_conjugate(k, k))
      end associate
      factor = 0.0_wp
      if (spring%branch_stiffness > 0.0_wp) factor = spring%relaxation_rate/spring%branch_stiffness
      ! P2 = P - k u, and u = -y_c where the static part is left out
      branch = 1.0_wp + spring%stiffness*modes%stop_value
      do m = 1, modes%count
         rate(:, m) = sqrt(2.0_wp*zeta*beam%oscillators%square)*modes%exponent(m)*modes%shape(:, m)
      end do
      do n = 1, modes%count
         do m = 1, modes%count
            losses%beam_plain(m, n) = sum(rate(:, m)*rate(:, n))
            losses%beam_conjugate(m, n) = sum(rate(:, m)*conjg(rate(:, n)))
            losses%stop_plain(m, n) = factor*branch(m)*branch(n)
            losses%stop_conjugate(m, n) = factor*branch(m)*conjg(branch(n))
         end do
      end do
   end subroutine make_contact_losses

   !> Dissipated from the start of a contact up to a time, integrated in closed form.
   pure subroutine contact_losses(beam, modes, losses, amplitude, q0, v0, t, lost)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> Exponents
      type(contact_modes_t), intent(in) :: modes
      !> From `make_contact_losses`
      type(contact_losses_t), intent(in) :: losses
      !> weight times c
      complex(wp), intent(in) :: amplitude(:)
      !> Modal state at the start; only the modes with a node at the stop are read
      real(wp), intent(in) :: q0(:)
      real(wp), intent(in) :: v0(:)
      !> Time
      real(wp), intent(in) :: t
      !> In the beam, in the stop
      real(wp), intent(out) :: lost(2)

      complex(wp) :: plain, conjugate, pair, factor(modes%count)
      real(wp), dimension(size(q0)) :: q, v
      integer :: m, n

      lost = 0.0_wp
      factor = exp(modes%exponent*t)
      do n = 1, modes%count
         do m = 1, modes%count
            pair = amplitude(m)*amplitude(n)
            plain = pair*integral(modes%exponent(m) + modes%exponent(n), t, factor(m)*factor(n))
            pair = amplitude(m)*conjg(amplitude(n))
            conjugate = pair*integral(modes%exponent(m) + conjg(modes%exponent(n)), t, factor(m)*conjg(factor(n)))
            lost(1) = lost(1) + 0.5_wp*real(losses%beam_plain(m, n)*plain + losses%beam_conjugate(m, n)*conjugate, wp)
            lost(2) = lost(2) + 0.5_wp*real(losses%stop_plain(m, n)*plain + losses%stop_conjugate(m, n)*conjugate, wp)
         end do
      end do
      if (size(modes%inactive) == 0) return
      call propagate(beam%oscillators, t, q0, v0, q, v)
      associate (i => modes%inactive, w2 => beam%oscillators%square)
         lost(1) = lost(1) + 0.5_wp*sum(v0(i)**2 - v(i)**2 + w2(i)*(q0(i)**2 - q(i)**2))
      end associate
   end subroutine contact_losses

   !> (exp(s t) - 1)/s without cancellation.
   elemental function integral(s, t, power) result(value)
      !> Exponent
      complex(wp), intent(in) :: s
      !> Time
      real(wp), intent(in) :: t
      !> exp(s t)
      complex(wp), intent(in) :: power
      complex(wp) :: value

      complex(wp) :: x

      x = s*t
      if (size_of(x) < 0.1_wp) then
         value = t*(1.0_wp + x/2.0_wp*(1.0_wp + x/3.0_wp*(1.0_wp + x/4.0_wp*(1.0_wp + x/5.0_wp*(1.0_wp + x/6.0_wp &
                    *(1.0_wp + x/7.0_wp*(1.0_wp + x/8.0_wp*(1.0_wp + x/9.0_wp*(1.0_wp + x/10.0_wp)))))))))
      else
         value = (power - 1.0_wp)/s
      end if
   end function integral

end module contact_modes
