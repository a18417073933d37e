!> A beam that presses on several stops, in closed form (docs/theory.md, sections 17 and 18).
!>
!> Everything that moves is a sum of exp(s t) over the roots s of `joint_secular`, its amplitudes the residues of the
!> Laplace transform. The beam is given in any modes of it, free or held elsewhere.
module joint_modes
   use damped_oscillators, only: oscillators_t
   use dependent_stops, only: part_stops, stop_parts_t
   use failures, only: fail, failure_t, status_run_failed
   use joint_secular, only: find_joint_roots
   use joint_terms, only: add_room, joint_amplitudes, joint_modes_t, make_room, put_in_order, ready_terms, terms_at
   use joint_vectors, only: joint_secular_t, joint_vectors_t, make_joint_secular, numerators, vectors_at
   use kinds, only: wp
   use point_forces, only: find_point_forces
   use pole_offsets, only: distances, size_of
   use small_equations, only: solve_small
   use yielding_stop, only: holds, impedance_t
   implicit none (type, external)
   private
   public :: joint_modes_t, make_joint_modes, joint_amplitudes, terms_at

   !> Modes whose values at the stops are below this share of the greatest do not feel them.
   real(wp), parameter :: least_coupling = 1.0e-100_wp

   !> Above this condition two exponents are taken together, by so many points of a circle around both.
   real(wp), parameter :: greatest_condition = 10.0_wp
   integer, parameter :: circle_points = 48

contains

   !> Find all exponents.
   subroutine make_joint_modes(oscillators, value, spring, modes, error)
      !> The modes of the beam
      type(oscillators_t), intent(in) :: oscillators
      !> They at the stops, [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> [stops]
      type(impedance_t), intent(in) :: spring(:)
      type(joint_modes_t), intent(out) :: modes
      !> Set when the iteration does not converge
      type(failure_t), allocatable, intent(inout) :: error

      type(joint_modes_t) :: of_parts
      type(stop_parts_t) :: parts
      real(wp) :: greatest
      integer :: i

      greatest = maxval(abs(value))
      modes%inactive = pack([(i, i=1, oscillators%count)], maxval(abs(value), dim=2) <= least_coupling*greatest)
      call part_stops(value, spring, parts)
      if (parts%is_needed) then
         of_parts%inactive = modes%inactive
         if (size(modes%inactive) < oscillators%count) then
            call find_terms(oscillators, parts%value, parts%spring, of_parts, error)
         else
            call make_room(of_parts, oscillators%count, size(parts%spring), 0)
         end if
         if (.not. allocated(error)) call join_parts(of_parts, parts, spring, oscillators%two_zeta, modes)
      else if (size(modes%inactive) < oscillators%count) then
         call find_terms(oscillators, value, spring, modes, error)
      else
         call make_room(modes, oscillators%count, size(spring), 0)
      end if
      if (allocated(error)) return
      modes%spring = spring
      modes%two_zeta = oscillators%two_zeta
      modes%mass_rate = oscillators%mass_rate(:oscillators%count)
      call put_in_order(modes)
      call ready_terms(modes)
      call find_rest(oscillators%square, value, spring, modes)
   end subroutine make_joint_modes

   !> All terms, for stops that the beam can move apart.
   subroutine find_terms(oscillators, value, spring, modes, error)
      type(oscillators_t), intent(in) :: oscillators
      !> [modes, stops]
      real(wp), intent(in) :: value(:, :)
      !> [stops]
      type(impedance_t), intent(in) :: spring(:)
      !> Knows which modes are inactive
      type(joint_modes_t), intent(inout) :: modes
      !> Set when the iteration does not converge
      type(failure_t), allocatable, intent(inout) :: error

      type(joint_secular_t) :: problem
      integer, allocatable :: active(:), near(:), keep(:)
      complex(wp), allocatable :: offset(:), s(:)
      integer :: i, n
      logical :: converged

      allocate (active, source=pack([(i, i=1, oscillators%count)], &
         [(all(modes%inactive /= i), i=1, oscillators%count)]))
      call make_joint_secular(oscillators%square(active), value(active, :), 0.5_wp*oscillators%two_zeta, &
         oscillators%mass_rate(active), spring, problem)
      n = problem%roots
      allocate (near(n), offset(n))
      call find_joint_roots(problem, near, offset, converged)
      if (.not. converged) then
         call fail(error, status_run_failed, 'the exponents of a contact with several stops were not found')
         return
      end if
      allocate (s, source=problem%pole(near) + offset)
      allocate (keep, source=pack([(i, i=1, n)], aimag(s) >= 0.0_wp))
      call make_room(modes, oscillators%count, size(spring), size(keep))
      call add_terms(problem, active, near, offset, s, keep, modes)
   end subroutine find_terms

   !> From the terms of stops that stand for others those of all, and what relaxes alone.
   pure subroutine join_parts(of_parts, parts, spring, two_zeta, modes)
      type(joint_modes_t), intent(in) :: of_parts
      type(stop_parts_t), intent(in) :: parts
      !> [stops]
      type(impedance_t), intent(in) :: spring(:)
      real(wp), intent(in) :: two_zeta
      !> Gets them
      type(joint_modes_t), intent(inout) :: modes

      complex(wp), dimension(size(parts%spring)) :: free, kept
      integer :: i, j, m, n

      n = of_parts%count
      call make_room(modes, size(of_parts%shape, 1), size(spring), n + size(parts%rate))
      modes%exponent(:n) = of_parts%exponent(:n)
      modes%weight(:n) = of_parts%weight(:n)
      modes%viscous(:n) = of_parts%viscous(:n)
      modes%shape(:, :n) = of_parts%shape(:, :n)
      modes%of_mode(:, :n) = of_parts%of_mode(:, :n)
      do m = 1, n
         ! of the equation (s + nu) P = M u, M = k (s + nu) + beta k s, what goes with k and with beta k
         kept = of_parts%exponent(m)*of_parts%of_memory(:, m)
         free = 0.0_wp
         where (parts%spring%stiffness > 0.0_wp) free = (of_parts%of_height(:, m) &
            - parts%spring%branch_stiffness*kept)/parts%spring%stiffness
         do j = 1, size(spring)
            associate (share => parts%share(:, j))
               modes%of_memory(j, m) = sum(share*of_parts%of_memory(:, m))
               if (parts%is_itself(j)) then
                  i = maxloc(share, dim=1)
                  modes%force(j, m) = of_parts%force(i, m)
                  modes%indentation(j, m) = of_parts%indentation(i, m)
                  modes%branch(j, m) = of_parts%branch(i, m)
                  modes%of_height(j, m) = of_parts%of_height(i, m)
               else
                  modes%indentation(j, m) = sum(share*of_parts%indentation(:, m))
                  modes%branch(j, m) = spring(j)%branch_stiffness*sum(share*of_parts%branch(:, m) &
                     /parts%spring%branch_stiffness, mask=abs(share) > 0.0_wp)
                  modes%force(j, m) = spring(j)%stiffness*modes%indentation(j, m) + modes%branch(j, m)
                  modes%of_height(j, m) = spring(j)%stiffness*sum(share*free, mask=abs(share) > 0.0_wp) &
                     + spring(j)%branch_stiffness*sum(share*kept)
               end if
            end associate
         end do
      end do
      do i = 1, size(parts%rate)
         m = n + i
         modes%exponent(m) = -parts%rate(i)
         modes%viscous(m) = 1.0_wp - two_zeta*parts%rate(i)
         modes%weight(m) = 1.0_wp
         modes%force(:, m) = parts%alone(:, i)
         modes%branch(:, m) = parts%alone(:, i)
         modes%of_memory(:, m) = parts%of_memory(:, i)
         modes%of_height(:, m) = -parts%rate(i)*spring%branch_stiffness*parts%of_memory(:, i)
      end do
      modes%count = n + size(parts%rate)
   end subroutine join_parts

   !> The state of rest under heights of the stops: the same forces in beam and springs.
   subroutine find_rest(square, value, spring, modes)
      !> W_i^2
      real(wp), intent(in) :: square(:)
      !> [modes, stops]
      real(wp), intent(in) :: value(:, :)
      type(impedance_t), intent(in) :: spring(:)
      type(joint_modes_t), intent(inout) :: modes

      complex(wp), dimension(size(spring)) :: flexibility, force, heights
      complex(wp), dimension(size(square)) :: nothing, shape
      integer :: k

      nothing = (0.0_wp, 0.0_wp)
      flexibility = (0.0_wp, 0.0_wp)
      where (.not. holds(spring)) flexibility = 1.0_wp/spring%stiffness
      allocate (modes%static_force(size(spring), size(spring)), modes%static_shape(size(square), size(spring)))
      do k = 1, size(spring)
         heights = (0.0_wp, 0.0_wp)
         heights(k) = 1.0_wp
         call find_point_forces(cmplx(square, 0.0_wp, wp), value, flexibility, nothing, heights, force, shape)
         modes%static_force(:, k) = real(force, wp)
         modes%static_shape(:, k) = real(shape, wp)
      end do
   end subroutine find_rest

   !> A term for each root, circles for those that nearly coalesce.
   !>
   !> Two of them have large amplitudes that cancel. Their sum is the integral of the Laplace transform over a circle
   !> around both, where nothing is large: the points of the trapezoidal rule take their place (Trefethen and Weideman,
   !> SIAM Rev. 56 (2014) 385).
   subroutine add_terms(problem, active, near, offset, s, keep, modes)
      type(joint_secular_t), intent(in) :: problem
      !> Modes that move a stop point
      integer, intent(in) :: active(:)
      !> All roots, by the nearest pole and as they are, and those with a term
      integer, intent(in) :: near(:)
      complex(wp), intent(in) :: offset(:)
      complex(wp), intent(in) :: s(:)
      integer, intent(in) :: keep(:)
      !> Gets them
      type(joint_modes_t), intent(inout) :: modes

      type(joint_vectors_t) :: vectors
      complex(wp) :: distance(problem%poles), center, direction
      real(wp) :: apart, room, radius, angle
      integer :: i, k, m, partner
      logical :: gone(size(s)), on_axis

      gone = .false.
      do m = 1, size(keep)
         if (gone(keep(m))) cycle
         call distances(problem%secular_t, near(keep(m)), offset(keep(m)), distance)
         call vectors_at(problem, s(keep(m)), 0, distance, vectors)
         if (vectors%condition > greatest_condition .and. size(s) > 1) then
            partner = minloc(abs(s - s(keep(m))), dim=1, mask=[(i, i=1, size(s))] /= keep(m))
            center = 0.5_wp*(s(keep(m)) + s(partner))
            apart = abs(s(keep(m)) - s(partner))
            on_axis = abs(aimag(center)) <= apart
            if (on_axis) center = real(center, wp)
            room = minval([huge(1.0_wp), abs(s - center)], mask=[.true., [(i, i=1, size(s))] /= keep(m) .and. &
               [(i, i=1, size(s))] /= partner])
            room = min(room, minval(abs(problem%pole - center)))
            ! inside the half plane of decay, far from everything else
            radius = min(0.3_wp*abs(real(center, wp)), 0.3_wp*room)
            if (radius >= 2.5_wp*apart) then
               gone(partner) = .true.
               call add_room(modes, circle_points*size(problem%spring))
               do k = 1, circle_points
                  angle = 2.0_wp*acos(-1.0_wp)*(real(k, wp) - 0.5_wp)/real(circle_points, wp)
                  ! around the real axis the lower half is the conjugate of the upper one
                  if (on_axis .and. k > circle_points/2) exit
                  direction = cmplx(cos(angle), sin(angle), wp)
                  call add_point(problem, active, center, radius*direction, modes)
               end do
               cycle
            end if
         end if
         call add_root(problem, active, s(keep(m)), problem%relative(near(keep(m))) &
            + problem%two_zeta*offset(keep(m)), distance, vectors, modes)
      end do
   end subroutine add_terms

   !> The term of a root.
   subroutine add_root(problem, active, s, viscous, distance, vectors, modes)
      type(joint_secular_t), intent(in) :: problem
      integer, intent(in) :: active(:)
      !> The root, 1 + 2 zeta s, and its distances from the poles
      complex(wp), intent(in) :: s
      complex(wp), intent(in) :: viscous
      complex(wp), intent(in) :: distance(:)
      type(joint_vectors_t), intent(in) :: vectors
      type(joint_modes_t), intent(inout) :: modes

      complex(wp) :: apart
      real(wp) :: size_right, size_left
      integer :: i

      modes%count = modes%count + 1
      associate (place => modes%count)
         modes%exponent(place) = s
         modes%viscous(place) = viscous
         modes%weight(place) = merge(2.0_wp, 1.0_wp, aimag(s) > 0.0_wp)
         size_right = max(1.0_wp, maxval(size_of(vectors%right)))
         size_left = max(1.0_wp, maxval(size_of(vectors%left)))
         apart = vectors%slope/(size_right*size_left)
         modes%force(:, place) = -vectors%right/size_right
         do i = 1, size(active)
            if (i == vectors%mode) then
               modes%shape(active(i), place) = 1.0_wp/size_right
            else
               modes%shape(active(i), place) = sum(problem%value(i, :)*modes%force(:, place)) &
                  /(distance(2*i - 1)*distance(2*i))
            end if
         end do
         ! l M = -P and l' T' y, with both vectors made smaller
         call find_stop_values(problem, s, distance, place, .true., active, modes)
         modes%of_height(:, place) = -modes%force(:, place)*(size_right/size_left)/apart
         modes%of_mode(:, place) = -modes%shape(:, place)*(size_right/size_left)/apart
         modes%of_memory(:, place) = vectors%left/size_left/apart
      end associate
   end subroutine add_root

   !> A point of a circle, with a term for each stop that gives something there.
   subroutine add_point(problem, active, center, arm, modes)
      type(joint_secular_t), intent(in) :: problem
      integer, intent(in) :: active(:)
      !> The center, and the point less the center
      complex(wp), intent(in) :: center
      complex(wp), intent(in) :: arm
      type(joint_modes_t), intent(inout) :: modes

      complex(wp) :: distance(problem%poles), s, h
      complex(wp), dimension(size(problem%spring), size(problem%spring)) :: matrix, unit, columns
      complex(wp), dimension(size(problem%spring)) :: n, m, n_slope, m_slope
      integer :: i, j, near

      s = center + arm
      near = minloc(abs(problem%pole - s), dim=1)
      call distances(problem%secular_t, near, s - problem%pole(near), distance)
      call numerators(problem, s, distance, n, m, n_slope, m_slope)
      matrix = 0.0_wp
      unit = 0.0_wp
      do j = 1, size(n)
         unit(j, j) = 1.0_wp
         matrix(j, j) = n(j)
         do i = 1, size(n)
            h = sum(problem%value(:, i)*problem%value(:, j)/(distance(1:2*problem%modes:2) &
               *distance(2:2*problem%modes:2)))
            matrix(i, j) = matrix(i, j) + m(i)*h
         end do
      end do
      columns = solve_small(matrix, unit)
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
               modes%of_mode(active(i), place) = m(j)*problem%value(i, j)/(distance(2*i - 1)*distance(2*i))
            end do
            modes%of_height(j, place) = m(j)
            modes%of_memory(j, place) = 1.0_wp
            call find_stop_values(problem, s, distance, place, .false., active, modes)
         end associate
      end do
   end subroutine add_point

   !> Indentation and branch of each stop in a term. At a root the stop's own equation holds, which is used where less
   !> cancels.
   subroutine find_stop_values(problem, s, distance, place, is_root, active, modes)
      type(joint_secular_t), intent(in) :: problem
      complex(wp), intent(in) :: s
      complex(wp), intent(in) :: distance(:)
      !> The term
      integer, intent(in) :: place
      logical, intent(in) :: is_root
      integer, intent(in) :: active(:)
      type(joint_modes_t), intent(inout) :: modes

      complex(wp) :: terms(size(active)), relaxed, total
      real(wp) :: greatest
      integer :: j

      greatest = maxval(size_of(modes%force(:, place)))
      do j = 1, size(problem%spring)
         associate (spring => problem%spring(j), force => modes%force(j, place), u => modes%indentation(j, place), &
            branch => modes%branch(j, place))
            if (holds(spring)) cycle
            terms = problem%value(:, j)*modes%shape(active, place)
            u = -sum(terms)
            relaxed = 1.0_wp
            if (problem%branch_pole(j) > 0) relaxed = distance(problem%branch_pole(j))
            total = (spring%stiffness + spring%viscosity*s)*relaxed + spring%branch_stiffness*s
            if (is_root) then
               ! the force is known within the rounding of that of the hardest stop, the indentation within that of the
               ! sum
               if (size_of(total)*sum(size_of(terms)) > size_of(relaxed)*greatest) then
                  u = force*relaxed/total
               else
                  force = total/relaxed*u
               end if
            end if
            branch = 0.0_wp
            if (problem%branch_pole(j) == 0) cycle
            if (is_root .and. spring%branch_stiffness*size_of(s) < spring%stiffness*size_of(relaxed)) then
               branch = spring%branch_stiffness*s/relaxed*u
            else
               branch = force - spring%stiffness*u
            end if
         end associate
      end do
   end subroutine find_stop_values

end module joint_modes
