!> Contacts at the start of a run, in any coordinates of the beam (docs/theory.md, section 18): static equilibrium on
!> contacts, the refusal of starts with penetration, and the projection of penetrations by rounding onto the contact
!> surfaces. Each integration method supplies its coordinates by extending `flexible_beam_t`.
module contact_starts
   use complementarity, only: close_gaps, solve_complementarity
   use failures, only: fail, failure_t, status_bad_input
   use free_modes, only: free_modes_t, max_rigid_square, mover_of
   use kinds, only: wp
   use number_text, only: rounded, to_text
   use point_forces, only: find_point_forces
   use stop_contacts, only: penetrates, contact_t
   use stop_laws, only: static_stiffness
   implicit none (type, external)
   private
   public :: flexible_beam_t, find_static_equilibrium, find_slow_balance, find_static_forces, check_start, &
      check_gaps, check_mode_count, move_onto_contacts

   !> Maximum relative tension or penetration of a contact that counts as rounding error in `find_slow_balance`.
   real(wp), parameter :: balance_tolerance = 1.0e-10_wp

   !> Maximum number of contacts of which all subsets are tried as supports of a beam with a mode of nearly zero
   !> frequency.
   integer, parameter :: max_supports = 12

   !> The beam in the coordinates q of one integration method.
   type, abstract :: flexible_beam_t
      !> Row w of each contact, a linear functional of the coordinates q: the gap is w . q - h, with h the height of the
      !> contact surface. The row is zero if a support fixes that point, [coordinates, contacts]
      real(wp), allocatable :: row(:, :)
   contains
      procedure(find_static_shapes), deferred :: find_static_shapes
   end type flexible_beam_t

   abstract interface
      !> Static displacements under loads, of the beam with an elastic foundation whose stiffness is a multiple of the
      !> mass matrix.
      pure subroutine find_static_shapes(self, foundation, load, shape, error)
         import :: failure_t, flexible_beam_t, wp
         implicit none (type, external)
         class(flexible_beam_t), intent(in) :: self
         !> Factor of the mass matrix in the stiffness of the foundation; 0: there is no foundation
         real(wp), intent(in) :: foundation
         !> Loads, [coordinates, loads]
         real(wp), intent(in) :: load(:, :)
         !> Displacements, [coordinates, loads]
         real(wp), intent(out) :: shape(:, :)
         !> Set if the displacements cannot be found
         type(failure_t), allocatable, intent(inout) :: error
      end subroutine find_static_shapes
   end interface

contains

   !> Static equilibrium on contacts with unilateral forces. The springs of compliant stops are in series with the beam.
   pure subroutine find_static_equilibrium(beam, contacts, is_active, displacement, forces, error)
      class(flexible_beam_t), intent(in) :: beam
      type(contact_t), intent(in) :: contacts(:)
      !> Whether each contact is active, [contacts]
      logical, intent(in) :: is_active(:)
      !> On entry displacements under the loads without contact forces, on return with them, [coordinates]
      real(wp), intent(inout) :: displacement(:)
      !> Force P >= 0 of each contact; those of inactive contacts are not changed
      real(wp), intent(inout) :: forces(:)
      !> Set if the static shapes cannot be found
      type(failure_t), allocatable, intent(inout) :: error

      real(wp) :: shape(size(displacement), count(is_active)), compliance(count(is_active), count(is_active)), &
         active_forces(count(is_active))
      ! indices of the active contacts
      integer :: place(count(is_active))
      integer :: k

      place = pack([(k, k=1, size(is_active))], is_active)
      call beam%find_static_shapes(0.0_wp, beam%row(:, place), shape, error)
      if (allocated(error)) return
      compliance = matmul(transpose(beam%row(:, place)), shape)
      call find_static_forces(contacts(place), matmul(displacement, beam%row(:, place)) - contacts(place)%height, &
         compliance, active_forces)
      displacement = displacement + matmul(shape, active_forces)
      forces(place) = active_forces
   end subroutine find_static_equilibrium

   !> Static equilibrium in modes, if the flexibility of a slow mode (a rotation about a pinned root, a mass without a
   !> spring) exceeds that of all other modes by orders of magnitude. Subsets of contacts are tried as bilateral
   !> supports until the violation (tension in a contact of the subset, or penetration of another contact) is within
   !> rounding error. The subset with the smallest violation is used.
   subroutine find_slow_balance(modes, row, contacts, is_active, load, q, forces, error)
      type(free_modes_t), intent(in) :: modes
      !> Rows of the contacts over the modes, [modes, contacts]
      real(wp), intent(in) :: row(:, :)
      type(contact_t), intent(in) :: contacts(:)
      !> Whether each contact is active, [contacts]
      logical, intent(in) :: is_active(:)
      !> Modal loads, [modes]
      real(wp), intent(in) :: load(:)
      !> Modal displacements, [modes]
      real(wp), intent(out) :: q(:)
      !> Force P >= 0 of each contact
      real(wp), intent(out) :: forces(:)
      !> Set if no contact carries a mass that moves freely
      type(failure_t), allocatable, intent(inout) :: error

      ! a subset with a larger violation is no equilibrium
      real(wp), parameter :: max_violation = 1.0e-6_wp
      ! a subset with larger displacements, in units of displacement, is no equilibrium
      real(wp), parameter :: max_displacement = 1.0e15_wp
      complex(wp), allocatable :: contact_force(:)
      complex(wp) :: z(size(load))
      ! a force that is comparable with the loads
      real(wp) :: unit
      real(wp) :: flexibility(size(contacts)), min_violation, violation
      real(wp), allocatable :: gap(:)
      ! indices of the contacts that can support the beam
      integer, allocatable :: place(:)
      integer, allocatable :: subset(:)
      ! number whose bits state which of these contacts belong to the subset
      integer :: choice
      integer :: k
      logical :: is_singular

      place = pack([(k, k=1, size(is_active))], is_active)
      min_violation = max_violation
      flexibility = static_stiffness(contacts%settings)
      where (flexibility > 0.0_wp) flexibility = 1.0_wp/flexibility
      unit = maxval(abs(load))/max(maxval(abs(row)), epsilon(1.0_wp)) + tiny(1.0_wp)
      ! the result if no subset is an equilibrium; its zero forces then lead to the message below
      q = load/modes%square
      forces = 0.0_wp
      do choice = 0, 2**min(size(place), max_supports) - 1
         subset = pack(place, [(btest(choice, k - 1), k=1, size(place))])
         allocate (contact_force(size(subset)))
         call find_point_forces(cmplx(modes%square, 0.0_wp, wp), row(:, subset), &
            cmplx(flexibility(subset), 0.0_wp, wp), cmplx(load, 0.0_wp, wp), &
            cmplx(contacts(subset)%height, 0.0_wp, wp), contact_force, z, is_singular)
         gap = matmul(real(z, wp), row) - contacts%height
         gap(subset) = 0.0_wp
         ! violation: the maximum of relative tension and relative penetration
         violation = max(0.0_wp, -minval([real(contact_force, wp), 0.0_wp])/(sum(abs(contact_force)) + unit), &
            -minval([gap(place), 0.0_wp])/(maxval(abs(contacts(place)%height)) + 1.0_wp))
         ! huge displacements mean that contacts of the subset do not hold a slow mode, or that two contacts constrain
         ! the same motion
         if (.not. is_singular .and. violation < min_violation .and. all(abs(z) < max_displacement)) then
            min_violation = violation
            q = real(z, wp)
            forces = 0.0_wp
            forces(subset) = max(real(contact_force, wp), 0.0_wp)
         end if
         deallocate (contact_force)
         if (min_violation <= balance_tolerance) exit
      end do
      do k = 1, size(load)
         if (modes%square(k) > max_rigid_square .or. abs(load(k)) <= 0.0_wp) cycle
         if (any(forces > 0.0_wp .and. abs(row(k, :)) > 0.0_wp)) cycle
         call fail(error, status_bad_input, 'nothing carries '//mover_of(modes, k)//': it has no balance to start in')
         return
      end do
   end subroutine find_slow_balance

   !> Unilateral static forces of contacts whose springs are in series with the beam.
   pure subroutine find_static_forces(contacts, gap, compliance, forces)
      !> The active contacts
      type(contact_t), intent(in) :: contacts(:)
      !> Gaps without contact forces
      real(wp), intent(in) :: gap(:)
      !> Compliance of the beam at the contacts; on return that of beam and contact springs in series, [contacts,
      !> contacts]
      real(wp), intent(inout) :: compliance(:, :)
      !> Force P >= 0 of each contact
      real(wp), intent(out) :: forces(:)

      real(wp) :: stiffness
      logical :: is_loaded(size(gap))
      integer :: k

      do k = 1, size(gap)
         stiffness = static_stiffness(contacts(k)%settings)
         if (stiffness > 0.0_wp) compliance(k, k) = compliance(k, k) + 1.0_wp/stiffness
      end do
      ! gap + compliance*forces >= 0, forces >= 0, and at each contact one of both is zero
      call solve_complementarity(compliance, gap, forces, is_loaded)
   end subroutine find_static_forces

   !> Refuse rigid stops at more points than modes that move these points: if all are closed, their forces are not
   !> determined.
   pure subroutine check_mode_count(contacts, dof, row, error)
      type(contact_t), intent(in) :: contacts(:)
      !> Degree of freedom of the beam at each contact
      integer, intent(in) :: dof(:)
      !> Row of each contact over the modes, [modes, contacts]
      real(wp), intent(in) :: row(:, :)
      !> Set if there are too few modes
      type(failure_t), allocatable, intent(inout) :: error

      integer, allocatable :: rigid(:)
      integer :: k, modes, points

      rigid = pack([(k, k=1, size(dof))], static_stiffness(contacts%settings) <= 0.0_wp .and. contacts%is_fixed)
      points = count([(findloc(dof(rigid), dof(rigid(k)), dim=1) == k, k=1, size(rigid))])
      if (points <= 1) return
      modes = count(any(abs(row(:, rigid)) > 0.0_wp, dim=2))
      if (points > modes .and. .not. allocated(error)) call fail(error, status_bad_input, to_text(points) &
         //' rigid stops can be closed at once, but the motion has '//to_text(modes)//' modes, so that their forces ' &
         //'are not determined: give more modes in &response, or compliant stops')
   end subroutine check_mode_count

   !> Refuse a start with penetration of a contact that bears no static force.
   pure subroutine check_start(beam, contacts, forces, displacement, error)
      class(flexible_beam_t), intent(in) :: beam
      type(contact_t), intent(in) :: contacts(:)
      !> Force P >= 0 of each contact
      real(wp), intent(in) :: forces(:)
      !> Displacements, [coordinates]
      real(wp), intent(in) :: displacement(:)
      !> Set if a contact without force is penetrated
      type(failure_t), allocatable, intent(inout) :: error

      call check_gaps(contacts, matmul(displacement, beam%row) - contacts%height, forces, error)
   end subroutine check_start

   !> Refuse gaps at the start that penetrate a contact without static force.
   pure subroutine check_gaps(contacts, gap, forces, error)
      type(contact_t), intent(in) :: contacts(:)
      !> Gap of each contact
      real(wp), intent(in) :: gap(:)
      !> Force P >= 0 of each contact
      real(wp), intent(in) :: forces(:)
      !> Set if a contact without force is penetrated
      type(failure_t), allocatable, intent(inout) :: error

      integer :: k

      k = findloc(penetrates(contacts, gap) .and. .not. forces > 0.0_wp, .true., dim=1)
      if (k > 0) call fail(error, status_bad_input, 'the beam starts beyond the surface at x/L = '// &
         to_text(contacts(k)%settings%position)//', by '//rounded(-gap(k))//' of the unit of displacement; ' &
         //"&start kind = 'balance' begins in equilibrium on the stops")
   end subroutine check_gaps

   !> Project penetrations within `penetration_tolerance` onto the contact surfaces. The displacements are those of
   !> forces at the contacts on a beam with an elastic foundation, because a beam with a rigid-body rotation has no
   !> static displacements without a foundation.
   pure subroutine move_onto_contacts(beam, contacts, is_active, forces, displacement, error)
      class(flexible_beam_t), intent(in) :: beam
      type(contact_t), intent(in) :: contacts(:)
      !> Whether each contact is active, [contacts]
      logical, intent(in) :: is_active(:)
      !> Force P of each contact; a compliant stop with a static force is indented, which is no penetration by rounding
      real(wp), intent(in) :: forces(:)
      !> Displacements, [coordinates]
      real(wp), intent(inout) :: displacement(:)
      !> Set if the static shapes cannot be found
      type(failure_t), allocatable, intent(inout) :: error

      real(wp), dimension(size(is_active)) :: gap, rounding, closing_forces
      real(wp) :: shape(size(displacement), size(is_active))
      ! indices of the contacts whose gaps are tested
      integer, allocatable :: place(:)
      integer :: k

      gap = matmul(displacement, beam%row) - contacts%height
      ! rounding errors of the gaps
      rounding = 4.0_wp*epsilon(1.0_wp)*(abs(contacts%height) + matmul(abs(displacement), abs(beam%row)))
      place = pack([(k, k=1, size(is_active))], is_active .and. .not. (forces > 0.0_wp .or. penetrates(contacts, gap)))
      associate (n => size(place))
         if (all(gap(place) >= -rounding(place))) return
         call beam%find_static_shapes(1.0_wp, beam%row(:, place), shape(:, :n), error)
         if (allocated(error)) return
         call close_gaps(matmul(transpose(beam%row(:, place)), shape(:, :n)), gap(place), rounding(place), &
            closing_forces(:n))
         displacement = displacement + matmul(shape(:, :n), closing_forces(:n))
      end associate
   end subroutine move_onto_contacts

end module contact_starts
