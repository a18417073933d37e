!> Constrained modes of the beam for a set of closed rigid contacts, which are bilateral constraints while they are
!> closed, and the static equilibrium of the beam on these contacts (docs/theory.md, section 17). Without closed rigid
!> contacts the constrained modes are the free modes. W_i^2 are the squared frequencies of the free modes, b_i their
!> values at a contact times the sign of the contact, w_j^2 the squared frequencies of the constrained modes, psi_ij the
!> coefficient of free mode i in constrained mode j, p_j its displacement, and a prime on q or p denotes d/dtau.
module constrained_sets
   use complementarity, only: solve_active
   use constrained_modes, only: constrain
   use damped_oscillators, only: damping_order, lanes, make_oscillators, oscillators_t, padded
   use free_modes, only: max_rigid_square
   use kinds, only: wp
   use modal_signal, only: make_modal_signal, modal_signal_t
   use point_forces, only: combine_rigid_modes, find_point_forces, slow_frequency, static_rows
   use sorting, only: order_columns
   implicit none (type, external)
   private
   public :: displacement_t, free_beam_t, constrained_set_t, are_constraints, has_mass_damping, carriers_among, &
      make_constrained_set, damp_constrained_set, find_static_state, to_constrained_modes, to_free_modes

   !> A displacement in which one mode alone takes part.
   type :: displacement_t
      !> Index of the mode
      integer :: mode = 0
      !> Displacement per unit of the mode
      real(wp) :: value = 1.0_wp
      !> Displacement at which the coordinate of the mode is zero
      real(wp) :: origin = 0.0_wp
   end type displacement_t

   !> The beam in its free modes, and its contacts.
   type :: free_beam_t
      type(oscillators_t) :: oscillators
      !> Whether each mode has a damping ratio of its own: the damping then couples the constrained modes
      logical :: has_modal_damping = .false.
      !> b_i: value of mode i at each contact times the sign s of the contact, [modes, contacts]
      real(wp), allocatable :: value(:, :)
      !> Value of mode i at the tip, [modes]
      real(wp), allocatable :: tip_value(:)
      !> Heights h of the contact surfaces in units of displacement; recorded points count from their `origin`,
      !> [contacts]
      real(wp), allocatable :: height(:)
      !> Heights h if recorded points count from z = 0, as in the results, [contacts]
      real(wp), allocatable :: observed_height(:)
      !> Change of each mode's velocity per unit velocity change at the only contact, if an impact changes the velocity
      !> of the node at this contact alone, [modes]; unallocated: impulses act on the whole beam
      real(wp), allocatable :: nodal_shape(:)
      !> Sign s of the contact if it is a stop at the tip, else 0, [contacts]
      real(wp), allocatable :: tip_sign(:)
      !> Displacements of the recorded points of the model
      type(displacement_t), allocatable :: displacement(:)
   end type free_beam_t

   !> The constrained modes of one set of closed rigid contacts.
   type :: constrained_set_t
      !> Number of sets of closed contacts that use these modes
      integer :: users = 0
      !> Indices of the closed rigid contacts
      integer, allocatable :: closed(:)
      !> Indices of closed contacts that apply forces, if the modes depend on them
      integer, allocatable :: carriers(:)
      !> Number of constrained modes
      integer :: count = 0
      type(oscillators_t) :: oscillators
      !> Constrained modes as combinations of the free modes, orthonormal, [free, count]; unallocated: the constrained
      !> modes are the free modes
      real(wp), allocatable :: mode(:, :)
      !> Whether a mode is so stiff that its strain energy under a rounding error of the displacement is significant
      logical :: has_stiff = .false.
      !> `mode`, padded with zeros to whole SIMD vectors, [padded free, count]
      real(wp), allocatable, private :: to_free(:, :)
      !> The transpose of `mode`, padded, [padded count, free]
      real(wp), allocatable, private :: to_set(:, :)
      !> Reaction of each closed rigid contact per unit of p + 2 zeta p', with p the displacement of each constrained
      !> mode, [closed, count]
      real(wp), allocatable :: reaction(:, :)
      !> Static equilibrium on the closed rigid contacts without loads: displacements of the free modes, [free]
      real(wp), allocatable :: static(:)
      !> Gaps in that equilibrium, [contacts]
      real(wp), allocatable :: static_gap(:)
      !> Reactions of the closed rigid contacts in that equilibrium, [closed]
      real(wp), allocatable :: static_force(:)
      !> Displacement of the tip in that equilibrium
      real(wp) :: static_tip = 0.0_wp
      !> Strain energy in that equilibrium
      real(wp) :: static_energy = 0.0_wp
      !> Values of the constrained modes at the contacts, times the sign of the contact, [count, contacts]
      real(wp), allocatable :: value(:, :)
      !> Values of the constrained modes at the tip, [count]
      real(wp), allocatable :: tip_value(:)
      !> Reactions of the closed rigid contacts that balance a unit force at each contact instantaneously, [closed,
      !> contacts]
      real(wp), allocatable :: balanced_fraction(:, :)
      !> Gaps as signals, [contacts]; each user sets the state of a signal before its evaluation
      type(modal_signal_t), allocatable :: gap(:)
      !> Reactions as signals, [closed]
      type(modal_signal_t), allocatable :: force(:)
   end type constrained_set_t

   !> Squared frequency above which a rounding error of the modal displacement is a significant strain energy
   real(wp), parameter :: min_stiff = 1.0e12_wp

contains

   !> Whether each rigid contact is a constraint while it is closed, [contacts]. If each mode has its own damping, a
   !> constraint would couple the modes by damping, unless one mode alone takes part in the contact, as in that of a
   !> body with its floor: the constraint then removes this mode.
   pure function are_constraints(beam) result(answer)
      type(free_beam_t), intent(in) :: beam
      logical :: answer(size(beam%height))

      answer = .not. beam%has_modal_damping .or. count(abs(beam%value) > 0.0_wp, dim=1) == 1
   end function are_constraints

   !> Whether damping is not purely stiffness-proportional. Damping may then change the order of the modes, and a rigid
   !> contact may have to apply a force instead of being a constraint.
   pure logical function has_mass_damping(beam) result(answer)
      type(free_beam_t), intent(in) :: beam

      answer = beam%has_modal_damping .or. any(abs(beam%oscillators%mass_rate) > 0.0_wp)
   end function has_mass_damping

   !> Closed contacts that apply forces on which the modes of a set depend: all of them if several modes have no
   !> restoring force, because combinations of these modes may leave the contacts undeformed, else none.
   pure function carriers_among(beam, compliant) result(carriers)
      type(free_beam_t), intent(in) :: beam
      !> Indices of the closed contacts that apply forces
      integer, intent(in) :: compliant(:)
      integer, allocatable :: carriers(:)

      allocate (carriers, source=pack(compliant, &
         spread(count(beam%oscillators%square <= max_rigid_square) > 1, 1, size(compliant))))
   end function carriers_among

   !> Constrain the beam at one closed rigid contact after the other. A motion without restoring force that leaves all
   !> contacts undeformed, as that of a beam that turns freely with a body that it carries, then becomes a mode of its
   !> own: among the terms exp(s t) of the contacts it would be one with s = 0 twice.
   subroutine make_constrained_set(beam, closed, set, carriers)
      type(free_beam_t), intent(in) :: beam
      !> Indices of the closed rigid contacts, no two at one point
      integer, intent(in) :: closed(:)
      !> Must not be moved in memory because its signals point to its oscillators
      type(constrained_set_t), target, intent(out) :: set
      !> From `carriers_among`
      integer, intent(in) :: carriers(:)

      ! the modes with one constraint more as combinations of the modes before, [modes before, modes after]
      real(wp), allocatable :: change(:, :)
      real(wp), allocatable :: square(:), new_reaction(:), new_square(:), fractions_before(:), reaction(:, :)
      ! coefficients of mass-proportional damping; if those of modes differ, the constraints do not combine these modes
      real(wp), allocatable :: mass_rate(:)
      integer, allocatable :: order(:)
      integer :: i, k

      set%closed = closed
      set%carriers = carriers
      allocate (square, source=beam%oscillators%square)
      mass_rate = beam%oscillators%mass_rate(:size(square))
      set%value = beam%value
      set%tip_value = beam%tip_value
      allocate (set%reaction(0, size(square)))
      allocate (set%balanced_fraction(size(closed), size(beam%height)), source=0.0_wp)
      do i = 1, size(closed)
         call constrain(square, set%value(:, closed(i)), 0.0_wp, new_square, change, new_reaction)
         ! fractions of a force at this contact that the contacts constrained before it balance
         fractions_before = set%balanced_fraction(:i - 1, closed(i))
         allocate (reaction(i, size(new_square)))
         reaction(:i - 1, :) = matmul(set%reaction, change)
         do k = 1, i - 1
            reaction(k, :) = reaction(k, :) - fractions_before(k)*new_reaction
         end do
         reaction(i, :) = new_reaction
         call move_alloc(reaction, set%reaction)
         do k = 1, size(beam%height)
            call distribute_force(set%value(:, closed(i)), set%value(:, k), fractions_before, i, &
               set%balanced_fraction(:, k))
         end do
         call combine_modes(change, set)
         square = new_square
         if (beam%has_modal_damping) mass_rate = matmul(mass_rate, change**2)
      end do
      call separate_rigid_motions(square, mass_rate(:size(square)), set)
      set%count = size(square)
      set%has_stiff = maxval(square) >= min_stiff
      associate (zeta => 0.5_wp*beam%oscillators%two_zeta)
         if (allocated(set%mode)) then
            order = damping_order(square, zeta, mass_rate(:set%count))
            square = square(order)
            mass_rate = mass_rate(order)
            call order_columns(set%mode, order)
            allocate (set%to_free(padded(size(set%mode, 1)), set%count), &
               set%to_set(padded(set%count), size(set%mode, 1)), &
               source=0.0_wp)
            set%to_free(:size(set%mode, 1), :) = set%mode
            ! an explicit loop, because `transpose` would need a temporary on the stack
            do i = 1, size(set%mode, 1)
               set%to_set(:set%count, i) = set%mode(i, :)
            end do
            set%reaction = set%reaction(:, order)
            set%value = set%value(order, :)
            set%tip_value = set%tip_value(order)
         end if
         call make_oscillators(square, zeta, set%oscillators, mass_rate)
      end associate
      ! exact zeros at the closed contacts instead of rounding errors
      set%value(:, closed) = 0.0_wp
      do k = 1, size(closed)
         if (abs(beam%tip_sign(closed(k))) > 0.0_wp) set%tip_value = 0.0_wp
      end do
      call make_signals(set)
      allocate (set%static(size(beam%oscillators%square)), set%static_force(size(closed)), &
         set%static_gap(size(beam%height)))
      call find_static_state(beam, set)
   end subroutine make_constrained_set

   !> Combine modes and their values at contacts and tip.
   pure subroutine combine_modes(change, set)
      !> The new modes as combinations of the modes before, [modes before, modes after]
      real(wp), intent(in) :: change(:, :)
      type(constrained_set_t), intent(inout) :: set

      real(wp), allocatable :: tip_value(:), value(:, :)

      allocate (value(size(change, 2), size(set%value, 2)), tip_value(size(change, 2)))
      value(:, :) = matmul(transpose(change), set%value)
      tip_value(:) = matmul(set%tip_value, change)
      call move_alloc(value, set%value)
      call move_alloc(tip_value, set%tip_value)
      allocate (value, source=change)
      if (allocated(set%mode)) deallocate (value)
      if (allocated(set%mode)) allocate (value, source=matmul(set%mode, change))
      call move_alloc(value, set%mode)
   end subroutine combine_modes

   !> Combine the modes without restoring forces so that each motion of them which leaves the carriers undeformed is a
   !> mode.
   pure subroutine separate_rigid_motions(square, mass_rate, set)
      !> Squared frequencies of the modes; each combination takes one of those of its modes, [modes]
      real(wp), intent(in) :: square(:)
      !> Coefficients of damping proportional to mass, [modes]
      real(wp), intent(in) :: mass_rate(:)
      type(constrained_set_t), intent(inout) :: set

      real(wp), allocatable :: change(:, :)
      logical :: is_still(size(square))
      integer :: i

      if (size(set%carriers) == 0) return
      call combine_rigid_modes(square, mass_rate, set%value(:, set%carriers), change, is_still)
      if (.not. any(is_still)) return
      call combine_modes(change, set)
      set%reaction(:, :) = matmul(set%reaction, change)
      ! exact zeros instead of rounding errors: no contact couples these modes
      set%value(pack([(i, i=1, size(square))], is_still), set%carriers) = 0.0_wp
   end subroutine separate_rigid_motions

   !> Signals of the gaps and reactions of a set, with the damping of its oscillators.
   subroutine make_signals(set)
      type(constrained_set_t), target, intent(inout) :: set

      integer :: k

      if (allocated(set%gap)) deallocate (set%gap, set%force)
      allocate (set%gap(size(set%value, 2)), set%force(size(set%closed)))
      do k = 1, size(set%gap)
         call make_modal_signal(set%oscillators, 0.0_wp, set%value(:, k), set%gap(k))
      end do
      do k = 1, size(set%closed)
         call make_modal_signal(set%oscillators, 0.0_wp, set%reaction(k, :), set%force(k))
         ! the modes enter a force by p + 2 zeta p' instead of p
         set%force(k)%is_viscous = .true.
      end do
   end subroutine make_signals

   !> Give a set the damping of its beam, which is proportional to stiffness alone and so changes neither the modes nor
   !> their order.
   subroutine damp_constrained_set(beam, set)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), target, intent(inout) :: set

      real(wp) :: square(set%count)

      square = set%oscillators%square
      call make_oscillators(square, 0.5_wp*beam%oscillators%two_zeta, set%oscillators)
      call make_signals(set)
   end subroutine damp_constrained_set

   !> Find the fraction of a force that the contact constrained last balances instantaneously, and correct the fractions
   !> of the contacts constrained before it.
   pure subroutine distribute_force(value_at_last, value, before, place, fraction)
      !> Modal values at the contact constrained last, [modes]
      real(wp), intent(in) :: value_at_last(:)
      !> Modal values at the contact of the force, [modes]
      real(wp), intent(in) :: value(:)
      !> Fractions of a force at the contact constrained last that the contacts constrained before it balance, [place -
      !> 1]
      real(wp), intent(in) :: before(:)
      !> Number of the contact in the order in which the contacts are constrained
      integer, intent(in) :: place
      !> Fractions of the force, [closed]
      real(wp), intent(inout) :: fraction(:)

      real(wp) :: ratio

      ratio = sum(value_at_last*value)/sum(value_at_last**2)
      fraction(place) = ratio
      fraction(:place - 1) = fraction(:place - 1) - ratio*before
   end subroutine distribute_force

   !> Static equilibrium on the closed rigid contacts at their present heights, without other loads.
   pure subroutine find_static_state(beam, set)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(inout) :: set

      complex(wp), dimension(size(beam%tip_value)) :: no_load, shape
      complex(wp), allocatable :: force(:), height(:), no_flexibility(:)
      ! rows of the contacts, and of motions without restoring forces
      real(wp), allocatable :: row(:, :)
      real(wp) :: flexibility(size(set%closed), size(set%closed)), stiffness
      integer :: j, k

      set%static_tip = 0.0_wp
      associate (h => beam%height(set%closed), b => beam%value(:, set%closed), square => beam%oscillators%square)
         do k = 1, size(set%closed)
            do j = 1, size(set%closed)
               flexibility(j, k) = sum(b(:, j)*b(:, k)/square)
            end do
         end do
         if (size(h) == 1) then
            ! a single contact needs no system of equations
            stiffness = 1.0_wp/flexibility(1, 1)
            set%static_force(:) = h*stiffness
            set%static(:) = h(1)*(b(:, 1)/square*stiffness)
            set%static_tip = h(1)*sum(beam%tip_value*(b(:, 1)/square*stiffness))
         else if (any(square < slow_frequency**2)) then
            ! slow modes are unknowns of the equations, because their flexibility would hide that of the other modes
            no_load = (0.0_wp, 0.0_wp)
            allocate (row, source=static_rows(square, b))
            allocate (height(size(row, 2)), source=(0.0_wp, 0.0_wp))
            allocate (force, no_flexibility, mold=height)
            no_flexibility = (0.0_wp, 0.0_wp)
            height(:size(h)) = cmplx(h, 0.0_wp, wp)
            call find_point_forces(cmplx(square, 0.0_wp, wp), row, no_flexibility, no_load, height, force, shape)
            set%static_force(:) = real(force(:size(h)), wp)
            set%static(:) = real(shape, wp)
            set%static_tip = sum(beam%tip_value*set%static)
         else
            call solve_active(flexibility, -h, spread(.true., 1, size(h)), set%static_force)
            set%static(:) = matmul(b, set%static_force)/square
            set%static_tip = sum(beam%tip_value*set%static)
         end if
         set%static_energy = 0.5_wp*sum(set%static_force*h)
      end associate
      do k = 1, size(beam%height)
         set%static_gap(k) = sum(beam%value(:, k)*set%static) - beam%height(k)
      end do
      set%static_gap(set%closed) = 0.0_wp
      do k = 1, size(set%closed)
         if (abs(beam%tip_sign(set%closed(k))) <= 0.0_wp) cycle
         set%static_tip = beam%tip_sign(set%closed(k))*beam%height(set%closed(k))
      end do
      set%gap%offset = set%static_gap
      set%force%offset = set%static_force
   end subroutine find_static_state

   !> Transform displacements relative to static equilibrium, and velocities, from the free modes to the constrained
   !> modes, p_j = sum psi_ij q_i. The rounding error of this sum is that of the mode with the largest displacement, and
   !> a force on a stiffer mode, so for stiffer modes the modal forces are summed: w_j^2 p_j = sum psi_ij W_i^2 q_i.
   !> That holds for displacements with closed gaps; the guess of a periodic motion may have others.
   pure subroutine to_constrained_modes(beam, set, q, v, p, rate)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(in) :: set
      !> Displacements of the free modes, [free]
      real(wp), contiguous, intent(in) :: q(:)
      !> Velocities of the free modes, [free]
      real(wp), contiguous, intent(in) :: v(:)
      !> Displacements of the constrained modes, [count]
      real(wp), contiguous, intent(out) :: p(:)
      !> Velocities of the constrained modes, [count]
      real(wp), contiguous, intent(out) :: rate(:)

      ! gaps up to this fraction of the sum of their summands are closed but for rounding errors, also those of instants
      real(wp), parameter :: max_gap = 1.0e-10_wp
      ! displacements, velocities and modal forces of the free modes, [free, 3]
      real(wp) :: state(size(q), 3)
      ! displacements, velocities and modal forces of the constrained modes, padded, [count, 3]
      real(wp) :: sums(padded(size(p)), 3)
      integer :: k

      if (.not. allocated(set%mode)) then
         p = q
         rate = v
         return
      end if
      state(:, 1) = q - set%static
      state(:, 2) = v
      state(:, 3) = beam%oscillators%square*state(:, 1)
      call combine_columns(size(set%to_set, 1)/lanes, size(q), size(state, 2), set%to_set, state, sums)
      p = sums(:set%count, 1)
      rate = sums(:set%count, 2)
      do k = 1, size(set%closed)
         associate (gap => beam%value(:, set%closed(k))*state(:, 1))
            if (abs(sum(gap)) > max_gap*sum(abs(gap))) return
         end associate
      end do
      associate (square => set%oscillators%square(:set%count), largest => maxloc(abs(state(:, 1)), dim=1))
         where (square > max(beam%oscillators%square(largest), max_rigid_square)) p = sums(:set%count, 3)/square
      end associate
   end subroutine to_constrained_modes

   !> Transform the state from the constrained modes to the free modes, q_i = sum psi_ij p_j; if that is more accurate
   !> for a stiff mode, by the forces W_i^2 q_i = sum psi_ij w_j^2 p_j + sum b_i reaction_j p_j, with a sum over the
   !> contacts in the last term.
   pure subroutine to_free_modes(beam, set, p, rate, q, v)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(in) :: set
      !> Displacements of the constrained modes, [count]
      real(wp), contiguous, intent(in) :: p(:)
      !> Velocities of the constrained modes, [count]
      real(wp), contiguous, intent(in) :: rate(:)
      !> Displacements of the free modes, [free]
      real(wp), contiguous, intent(out) :: q(:)
      !> Velocities of the free modes, [free]
      real(wp), contiguous, intent(out) :: v(:)

      real(wp), dimension(size(set%closed)) :: reaction, magnitude
      real(wp) :: forces(set%count)
      ! displacements and velocities of the constrained modes, [count, 2]
      real(wp) :: state(size(p), 2)
      ! displacements and velocities of the free modes, padded, [free, 2]
      real(wp) :: sums(padded(size(q)), 2)
      integer :: i

      if (.not. allocated(set%mode)) then
         q = p
         v = rate
         return
      end if
      state(:, 1) = p
      state(:, 2) = rate
      call combine_columns(size(set%to_free, 1)/lanes, size(p), size(state, 2), set%to_free, state, sums)
      q = sums(:size(q), 1)
      v = sums(:size(v), 2)
      if (set%has_stiff) then
         forces = set%oscillators%square*p
         reaction = matmul(set%reaction, p)
         magnitude = matmul(abs(set%reaction), abs(p))
         do i = 1, size(q)
            if (beam%oscillators%square(i) <= max_rigid_square) cycle
            if (sum(abs(set%mode(i, :)*forces)) + sum(abs(beam%value(i, set%closed))*magnitude) < &
               beam%oscillators%square(i)*sum(abs(set%mode(i, :)*p))) then
               q(i) = (sum(set%mode(i, :)*forces) + sum(beam%value(i, set%closed)*reaction))/beam%oscillators%square(i)
            end if
         end do
      end if
      q = set%static + q
   end subroutine to_free_modes

   !> Linear combinations of the columns of a matrix, in whole SIMD vectors.
   pure subroutine combine_columns(blocks, columns, combinations, matrix, coefficient, total)
      !> Number of SIMD vectors in each column
      integer, intent(in) :: blocks
      !> Number of columns
      integer, intent(in) :: columns
      !> Number of combinations
      integer, intent(in) :: combinations
      real(wp), intent(in) :: matrix(lanes, blocks, columns)
      !> Coefficient of each column in each combination
      real(wp), intent(in) :: coefficient(columns, combinations)
      !> The combinations
      real(wp), intent(out) :: total(lanes, blocks, combinations)

      real(wp) :: partial(lanes)
      integer :: b, i, k

      do k = 1, combinations
         do b = 1, blocks
            partial = 0.0_wp
            do i = 1, columns
               partial = partial + matrix(:, b, i)*coefficient(i, k)
            end do
            total(:, b, k) = partial
         end do
      end do
   end subroutine combine_columns

end module constrained_sets
