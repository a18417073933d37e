!> Motion of a beam with several closed compliant contacts, in closed form (docs/theory.md, sections 17 and 18).
!>
!> Every displacement and force is a sum of terms exp(s t) over the roots s of `coupled_roots`, with the residues of the
!> Laplace transform as amplitudes. The beam is given in its free modes, or in its constrained modes if rigid contacts
!> are closed, too.
module coupled_modes
   use compliant_stop, only: is_rigid_stop, dynamic_stiffness_t
   use coupled_equation, only: coupled_equation_t, make_coupled_equation, stop_fractions
   use coupled_roots, only: find_circle, find_coupled_roots
   use coupled_terms, only: allocate_terms, append_terms, compare_sides, coupled_modes_t, enlarge_terms, mirror_terms, &
      pad_terms, sort_terms
   use coupled_vectors, only: coupled_vectors_t, vectors_at_root
   use damped_oscillators, only: oscillators_t
   use equivalent_stops, only: find_equivalent_stops, equivalent_stops_t, reduce_rows
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: pi, wp
   use point_forces, only: find_point_forces, static_rows
   use pole_offsets, only: distances, abs1
   use small_equations, only: solve_small
   use term_amplitudes, only: coupled_amplitudes, terms_at
   implicit none (type, external)
   private
   public :: coupled_modes_t, make_coupled_modes, compare_sides, mirror_terms, coupled_amplitudes, terms_at

   !> Modes whose values at the stops are below this fraction of the maximum do not interact with the stops.
   real(wp), parameter :: min_coupling = 1.0e-100_wp

   !> Exponents are treated as nearly coalescing if the condition number of the slope of the equation exceeds this
   !> value.
   real(wp), parameter :: max_condition = 10.0_wp
   !> Number of points on a circle around nearly coalescing exponents.
   integer, parameter :: circle_points = 48

contains

   !> Find all exponents, their shapes and amplitude factors.
   subroutine make_coupled_modes(oscillators, value, spring, modes, error)
      !> Modes of the beam
      type(oscillators_t), intent(in) :: oscillators
      !> Values of the modes at the stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses of the stops, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(coupled_modes_t), intent(out) :: modes
      !> Set if the iteration does not converge
      type(failure_t), allocatable, intent(inout) :: error

      type(coupled_modes_t) :: of_equivalents
      type(equivalent_stops_t) :: equivalent
      ! rows of the stops after `reduce_rows`, [modes, stops]
      real(wp) :: row(oscillators%count, size(spring))
      ! index of the rigid stop whose row `reduce_rows` has added to that of each stop; 0: none
      integer :: base(size(spring))
      ! factor of the added row
      real(wp) :: factor(size(spring))
      integer :: i, j

      row = value
      call reduce_rows(spring, row, base, factor)
      modes%inactive = pack([(i, i=1, oscillators%count)], maxval(abs(value), dim=2) <= min_coupling*maxval(abs(value)))
      call find_equivalent_stops(row, spring, equivalent)
      if (equivalent%is_needed) then
         of_equivalents%inactive = modes%inactive
         if (size(modes%inactive) < oscillators%count) then
            call find_terms_of_groups(oscillators, equivalent%value, equivalent%spring, of_equivalents, error)
         else
            call allocate_terms(of_equivalents, oscillators%count, size(equivalent%spring), 0)
         end if
         if (.not. allocated(error)) call expand_equivalents(of_equivalents, equivalent, spring, &
            oscillators%two_zeta, modes)
      else if (size(modes%inactive) < oscillators%count) then
         call find_terms_of_groups(oscillators, row, spring, modes, error)
      else
         call allocate_terms(modes, oscillators%count, size(spring), 0)
      end if
      if (allocated(error)) return
      ! back to the rows before `reduce_rows`: the force of stop j, with the row b_j + c b_i, also acts c-fold at the
      ! rigid stop i, and its height is h_j + c h_i
      do j = 1, size(spring)
         if (base(j) == 0) cycle
         modes%force(base(j), :) = modes%force(base(j), :) + factor(j)*modes%force(j, :)
         modes%height_weight(base(j), :) = modes%height_weight(base(j), :) + factor(j)*modes%height_weight(j, :)
      end do
      modes%spring = spring
      modes%two_zeta = oscillators%two_zeta
      modes%mass_rate = oscillators%mass_rate(:oscillators%count)
      call sort_terms(modes)
      call pad_terms(modes)
      call find_static_response(oscillators%square, value, spring, modes)
   end subroutine make_coupled_modes

   !> Find all terms for stops with linearly independent columns of modal values, for each group of stops that share
   !> modes: at a root of one group the equation of another group would be singular.
   subroutine find_terms_of_groups(oscillators, value, spring, modes, error)
      type(oscillators_t), intent(in) :: oscillators
      !> Values of the modes at the stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses of the stops, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Contains the list of inactive modes, which have nodes at all stops; receives the terms
      type(coupled_modes_t), intent(inout) :: modes
      !> Set if the iteration does not converge
      type(failure_t), allocatable, intent(inout) :: error

      type(coupled_modes_t) :: part
      integer, allocatable :: members(:)
      integer :: group(size(spring)), g, i, j
      logical :: moves(oscillators%count, size(spring))

      moves = abs(value) > min_coupling*maxval(abs(value))
      group = [(j, j=1, size(spring))]
      do j = 2, size(spring)
         do i = 1, j - 1
            if (.not. any(moves(:, i) .and. moves(:, j))) cycle
            where (group == group(j)) group = group(i)
         end do
      end do
      if (all(group == group(1))) then
         call find_terms(oscillators, value, spring, modes, error)
         return
      end if
      call allocate_terms(modes, oscillators%count, size(spring), 0)
      do g = 1, size(spring)
         members = pack([(j, j=1, size(spring))], group == g)
         ! a stop that no mode moves has no terms
         if (.not. any(moves(:, members))) cycle
         part = coupled_modes_t()
         part%inactive = pack([(i, i=1, oscillators%count)], .not. any(moves(:, members), dim=2))
         call find_terms(oscillators, value(:, members), spring(members), part, error)
         if (allocated(error)) return
         call append_terms(part, members, modes)
      end do
   end subroutine find_terms_of_groups

   !> Find all terms of a group of stops.
   subroutine find_terms(oscillators, value, spring, modes, error)
      type(oscillators_t), intent(in) :: oscillators
      !> Values of the modes at the stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> Dynamic stiffnesses of the stops, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Contains the list of inactive modes, which have nodes at all stops; receives the terms
      type(coupled_modes_t), intent(inout) :: modes
      !> Set if the iteration does not converge
      type(failure_t), allocatable, intent(inout) :: error

      type(coupled_equation_t) :: problem
      integer, allocatable :: active(:), near(:), upper(:)
      complex(wp), allocatable :: offset(:), s(:)
      integer :: i, n
      logical :: converged

      allocate (active, source=pack([(i, i=1, oscillators%count)], &
         [(all(modes%inactive /= i), i=1, oscillators%count)]))
      call make_coupled_equation(oscillators%square(active), value(active, :), 0.5_wp*oscillators%two_zeta, &
         oscillators%mass_rate(active), spring, problem)
      n = problem%roots
      allocate (near(n), offset(n))
      call find_coupled_roots(problem, near, offset, converged)
      if (.not. converged) call fail(error, status_run_failed, &
         'the exponents of a contact with several stops were not found')
      if (allocated(error)) return
      allocate (s, source=problem%pole(near) + offset)
      allocate (upper, source=pack([(i, i=1, n)], aimag(s) >= 0.0_wp))
      call allocate_terms(modes, oscillators%count, size(spring), size(upper))
      call add_terms(problem, active, near, offset, s, upper, modes)
   end subroutine find_terms

   !> Find the terms of all stops from those of the equivalent stops, and those of the independently relaxing branches.
   pure subroutine expand_equivalents(of_equivalents, equivalent, spring, two_zeta, modes)
      type(coupled_modes_t), intent(in) :: of_equivalents
      type(equivalent_stops_t), intent(in) :: equivalent
      !> Dynamic stiffnesses of the stops, [stops]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      real(wp), intent(in) :: two_zeta
      !> Receives the terms
      type(coupled_modes_t), intent(inout) :: modes

      complex(wp), dimension(size(equivalent%spring)) :: elastic, branch
      integer :: i, j, m, n

      n = of_equivalents%count
      call allocate_terms(modes, size(of_equivalents%shape, 1), size(spring), n + size(equivalent%rate))
      modes%exponent(:n) = of_equivalents%exponent(:n)
      modes%weight(:n) = of_equivalents%weight(:n)
      modes%viscous(:n) = of_equivalents%viscous(:n)
      modes%shape(:, :n) = of_equivalents%shape(:, :n)
      modes%mode_weight(:, :n) = of_equivalents%mode_weight(:, :n)
      do m = 1, n
         ! `height_weight` is `memory_weight` times M = k (s + nu) + beta k s: split it into its factors `elastic` of k
         ! and `branch` of beta k
         branch = of_equivalents%exponent(m)*of_equivalents%memory_weight(:, m)
         elastic = 0.0_wp
         where (equivalent%spring%stiffness > 0.0_wp) elastic = (of_equivalents%height_weight(:, m) &
            - equivalent%spring%branch_stiffness*branch)/equivalent%spring%stiffness
         do j = 1, size(spring)
            associate (combination => equivalent%combination(:, j))
               modes%memory_weight(j, m) = sum(combination*of_equivalents%memory_weight(:, m))
               if (equivalent%is_own_equivalent(j)) then
                  i = maxloc(combination, dim=1)
                  modes%force(j, m) = of_equivalents%force(i, m)
                  modes%indentation(j, m) = of_equivalents%indentation(i, m)
                  modes%branch(j, m) = of_equivalents%branch(i, m)
                  modes%height_weight(j, m) = of_equivalents%height_weight(i, m)
               else
                  ! u and P2/(beta k) of a stop are the combinations S' of those of the equivalent stops
                  modes%indentation(j, m) = sum(combination*of_equivalents%indentation(:, m))
                  modes%branch(j, m) = spring(j)%branch_stiffness*sum(combination*of_equivalents%branch(:, m) &
                     /equivalent%spring%branch_stiffness, mask=abs(combination) > 0.0_wp)
                  modes%force(j, m) = spring(j)%stiffness*modes%indentation(j, m) + modes%branch(j, m)
                  modes%height_weight(j, m) = spring(j)%stiffness*sum(combination*elastic, &
                     mask=abs(combination) > 0.0_wp) + spring(j)%branch_stiffness*sum(combination*branch)
               end if
            end associate
         end do
      end do
      do i = 1, size(equivalent%rate)
         m = n + i
         modes%exponent(m) = -equivalent%rate(i)
         modes%viscous(m) = 1.0_wp - two_zeta*equivalent%rate(i)
         modes%weight(m) = 1.0_wp
         modes%force(:, m) = equivalent%independent(:, i)
         modes%branch(:, m) = equivalent%independent(:, i)
         modes%memory_weight(:, m) = equivalent%memory_weight(:, i)
         modes%height_weight(:, m) = -equivalent%rate(i)*spring%branch_stiffness*equivalent%memory_weight(:, i)
      end do
      modes%count = n + size(equivalent%rate)
   end subroutine expand_equivalents

   !> Static equilibrium under a unit height of each stop in turn, in which beam and springs exert equal forces on each
   !> other.
   subroutine find_static_response(square, value, spring, modes)
      !> Squared circular frequencies W_i^2, [modes]
      real(wp), intent(in) :: square(:)
      !> Values of the modes at the stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(coupled_modes_t), intent(inout) :: modes

      complex(wp), allocatable :: flexibility(:), force(:), heights(:)
      complex(wp), dimension(size(square)) :: no_load, shape
      real(wp), allocatable :: row(:, :)
      integer :: k, n

      n = size(spring)
      allocate (row, source=static_rows(square, value))
      no_load = (0.0_wp, 0.0_wp)
      allocate (flexibility(size(row, 2)), source=(0.0_wp, 0.0_wp))
      allocate (force, heights, mold=flexibility)
      where (.not. is_rigid_stop(spring)) flexibility(:n) = 1.0_wp/spring%stiffness
      allocate (modes%static_force(n, n), modes%static_shape(size(square), n))
      do k = 1, n
         heights = (0.0_wp, 0.0_wp)
         heights(k) = 1.0_wp
         call find_point_forces(cmplx(square, 0.0_wp, wp), row, flexibility, no_load, heights, force, shape)
         modes%static_force(:, k) = real(force(:n), wp)
         modes%static_shape(:, k) = real(shape, wp)
      end do
   end subroutine find_static_response

   !> Add one term for each root, and circles around groups of nearly coalescing roots.
   !>
   !> Nearly coalescing roots have large amplitudes that cancel. Their sum is the integral of the Laplace transform over
   !> a circle around all of them, on which no value is large. The points of the trapezoidal rule on the circle replace
   !> the roots (Trefethen and Weideman, SIAM Rev. 56 (2014) 385).
   subroutine add_terms(problem, active, near, offset, s, upper, modes)
      type(coupled_equation_t), intent(in) :: problem
      !> Indices of the modes with nonzero values at stops
      integer, intent(in) :: active(:)
      !> Index of the pole that is nearest to each root, [roots]
      integer, intent(in) :: near(:)
      !> Offset of each root from that pole, [roots]
      complex(wp), intent(in) :: offset(:)
      !> Values s of the roots, [roots]
      complex(wp), intent(in) :: s(:)
      !> Indices of the roots with Im s >= 0
      integer, intent(in) :: upper(:)
      !> Receives the terms
      type(coupled_modes_t), intent(inout) :: modes

      type(coupled_vectors_t) :: vectors
      complex(wp) :: distance(problem%poles), center
      real(wp) :: radius, angle
      integer :: k, m
      ! the root is represented: by its own term, or by a circle
      logical :: done(size(s))
      ! the circle encloses the root
      logical :: is_inside(size(s))

      done = .false.
      do m = 1, size(upper)
         if (done(upper(m))) cycle
         call distances(problem%secular_t, near(upper(m)), offset(upper(m)), distance)
         call vectors_at_root(problem, s(upper(m)), distance, vectors)
         radius = 0.0_wp
         is_inside = .false.
         if (vectors%condition > max_condition) call find_circle(problem, s, upper(m), is_inside, center, radius)
         if (radius > 0.0_wp .and. .not. any(done .and. is_inside)) then
            done = done .or. is_inside
            call enlarge_terms(modes, circle_points*size(problem%spring))
            do k = 1, circle_points
               angle = 2.0_wp*pi*(real(k, wp) - 0.5_wp)/real(circle_points, wp)
               ! for a circle around a real centre the lower half is the conjugate of the upper half
               if (abs(aimag(center)) <= 0.0_wp .and. k > circle_points/2) exit
               call add_circle_point(problem, active, center, radius*cmplx(cos(angle), sin(angle), wp), modes)
            end do
         else
            done(upper(m)) = .true.
            call add_root(problem, active, s(upper(m)), problem%relative(near(upper(m))) &
               + problem%two_zeta*offset(upper(m)), distance, vectors, modes)
         end if
      end do
   end subroutine add_terms

   !> Add the term of a root.
   subroutine add_root(problem, active, s, viscous, distance, vectors, modes)
      type(coupled_equation_t), intent(in) :: problem
      !> Indices of the modes with nonzero values at stops
      integer, intent(in) :: active(:)
      !> The root s
      complex(wp), intent(in) :: s
      !> 1 + 2 zeta s
      complex(wp), intent(in) :: viscous
      !> Distances of the root from the poles, [poles]
      complex(wp), intent(in) :: distance(:)
      type(coupled_vectors_t), intent(in) :: vectors
      type(coupled_modes_t), intent(inout) :: modes

      complex(wp) :: scaled_slope, shape(size(active))
      real(wp) :: size_right, size_left
      integer :: j

      modes%count = modes%count + 1
      associate (place => modes%count)
         modes%exponent(place) = s
         modes%viscous(place) = viscous
         modes%weight(place) = merge(2.0_wp, 1.0_wp, aimag(s) > 0.0_wp)
         size_right = max(1.0_wp, maxval(abs1(vectors%right)))
         size_left = max(1.0_wp, maxval(abs1(vectors%left)))
         scaled_slope = vectors%slope/(size_right*size_left)
         modes%force(:, place) = -vectors%right/size_right
         shape(:) = (0.0_wp, 0.0_wp)
         do j = 1, size(problem%spring)
            shape(:) = shape + problem%value(:, j)*modes%force(j, place)
         end do
         shape(:) = shape*cmplx(vectors%term(:problem%modes, 1), vectors%term(:problem%modes, 2), wp)
         if (vectors%mode > 0) shape(vectors%mode) = 1.0_wp/size_right
         ! forces on a body between two stops almost cancel in slow motion
         shape(vectors%dominant) = -vectors%coordinate/size_right
         modes%shape(active, place) = shape
         call find_stop_values(problem, s, distance, place, .true., active, modes)
         ! with T = N + M H (`coupled_equation`) and T' its derivative with respect to s, the vectors with T y = 0 and l
         ! T = 0 at the root are y = P = -`right` and l = `left`; l M = -y, and the slope of the equation is l T' y.
         ! Both vectors are scaled to magnitudes of at most 1
         modes%height_weight(:, place) = -modes%force(:, place)*(size_right/size_left)/scaled_slope
         modes%mode_weight(:, place) = -modes%shape(:, place)*(size_right/size_left)/scaled_slope
         modes%memory_weight(:, place) = vectors%left/size_left/scaled_slope
      end associate
   end subroutine add_root

   !> Add the terms of a point of a circle around roots, one term for each stop. The weight 2 stands for the point
   !> and its complex conjugate, which is not stored.
   subroutine add_circle_point(problem, active, center, arm, modes)
      type(coupled_equation_t), intent(in) :: problem
      integer, intent(in) :: active(:)
      !> Centre of the circle
      complex(wp), intent(in) :: center
      !> The point minus the centre
      complex(wp), intent(in) :: arm
      type(coupled_modes_t), intent(inout) :: modes

      complex(wp) :: distance(problem%poles), s, h
      complex(wp), dimension(size(problem%spring), size(problem%spring)) :: matrix, identity, columns
      ! N of `coupled_equation` for each stop
      complex(wp) :: n(size(problem%spring))
      ! M of `coupled_equation` for each stop
      complex(wp) :: m(size(problem%spring))
      ! derivative of N with respect to s
      complex(wp) :: n_slope(size(problem%spring))
      ! derivative of M with respect to s
      complex(wp) :: m_slope(size(problem%spring))
      integer :: i, j, near

      s = center + arm
      near = minloc(abs(problem%pole - s), dim=1)
      call distances(problem%secular_t, near, s - problem%pole(near), distance)
      call stop_fractions(problem, s, distance, n, m, n_slope, m_slope)
      matrix = 0.0_wp
      identity = 0.0_wp
      do j = 1, size(n)
         identity(j, j) = 1.0_wp
         matrix(j, j) = n(j)
         do i = 1, size(n)
            h = sum(problem%value(:, i)*problem%value(:, j)/(distance(1:2*problem%modes:2) &
               *distance(2:2*problem%modes:2)))
            matrix(i, j) = matrix(i, j) + m(i)*h
         end do
      end do
      ! the trapezoidal rule sums T^-1, with T = N + M H, times the arm over the number of points
      columns = solve_small(matrix, identity)
      do j = 1, size(n)
         modes%count = modes%count + 1
         associate (place => modes%count)
            modes%exponent(place) = s
            modes%viscous(place) = 1.0_wp + problem%two_zeta*s
            modes%weight(place) = 2.0_wp
            modes%force(:, place) = columns(:, j)*(arm/real(circle_points, wp))
            do i = 1, size(active)
               modes%shape(active(i), place) = sum(problem%value(i, :)*modes%force(:, place)) &
                  /(distance(2*i - 1)*distance(2*i))
               modes%mode_weight(active(i), place) = m(j)*problem%value(i, j)/(distance(2*i - 1)*distance(2*i))
            end do
            modes%height_weight(j, place) = m(j)
            modes%memory_weight(j, place) = 1.0_wp
            call find_stop_values(problem, s, distance, place, .false., active, modes)
         end associate
      end do
   end subroutine add_circle_point

   !> Indentation and branch force of each stop in a term. The indentation is minus the sum over the modes. At a root
   !> the force-indentation law of the stop holds as well: it gives the indentation if the force is more accurate than
   !> that sum, and replaces the force if not. At a point of a circle it does not hold.
   subroutine find_stop_values(problem, s, distance, place, is_root, active, modes)
      type(coupled_equation_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      complex(wp), intent(in) :: distance(:)
      !> Index of the term
      integer, intent(in) :: place
      !> Whether the exponent of the term is a root; if not, it is a point of a circle
      logical, intent(in) :: is_root
      integer, intent(in) :: active(:)
      type(coupled_modes_t), intent(inout) :: modes

      complex(wp) :: shape(size(active))
      ! N and M of `coupled_equation` for each stop, and their derivatives: M u = N P
      complex(wp), dimension(size(problem%spring)) :: n, m, n_slope, m_slope
      ! real and imaginary part of a term of the sum over the modes (`part`, `imag`) and of this sum; sum of the
      ! magnitudes of the terms
      real(wp) :: imag, part, sum_imag, sum_real, magnitude, max_force
      integer :: i, j

      call stop_fractions(problem, s, distance, n, m, n_slope, m_slope)
      max_force = maxval(abs1(modes%force(:, place)))
      shape = modes%shape(active, place)
      do j = 1, size(problem%spring)
         associate (spring => problem%spring(j), force => modes%force(j, place), u => modes%indentation(j, place), &
            branch => modes%branch(j, place))
            if (is_rigid_stop(spring)) cycle
            sum_real = 0.0_wp
            sum_imag = 0.0_wp
            magnitude = 0.0_wp
            !$omp simd private(part, imag) reduction(+:sum_real, sum_imag, magnitude)
            do i = 1, size(shape)
               part = problem%value(i, j)*real(shape(i), wp)
               imag = problem%value(i, j)*aimag(shape(i))
               sum_real = sum_real + part
               sum_imag = sum_imag + imag
               magnitude = magnitude + (abs(part) + abs(imag))
            end do
            u = -cmplx(sum_real, sum_imag, wp)
            if (is_root) then
               ! the rounding error of the force is `epsilon` times the maximum force of all stops in this term, that
               ! of the sum `epsilon` times the magnitudes of its summands
               if (abs1(m(j))*magnitude > abs1(n(j))*max_force) then
                  u = force*n(j)/m(j)
               else
                  force = m(j)/n(j)*u
               end if
            end if
            branch = 0.0_wp
            if (problem%branch_pole(j) == 0) cycle
            ! P2 follows from the law of the branch if it is the smaller part of the force, because P - k u would lose
            ! its digits
            if (is_root .and. spring%branch_stiffness*abs1(s) < spring%stiffness*abs1(n(j))) then
               branch = spring%branch_stiffness*s/n(j)*u
            else
               branch = force - spring%stiffness*u
            end if
         end associate
      end do
   end subroutine find_stop_values

end module coupled_modes
