!> How a beam starts on its contacts, in any coordinates (docs/theory.md, section 18): which carry it, whether one is in
!> the way, and what lies beyond one by rounding is moved onto it. A way through time supplies rows and static shapes.
module contact_starts
   use complementarity, only: close_gaps, solve_complementarity
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: wp
   use number_text, only: to_text
   use stop_laws, only: static_stiffness
   use stop_contacts, only: is_beyond, contact_t
   implicit none (type, external)
   private
   public :: flexible_beam_t, carry, find_carrying_forces, check_start, move_onto_contacts

   type, abstract :: flexible_beam_t
      !> w of each contact, whose gap is w . q - h; zero where the beam is held, [coordinates, contacts]
      real(wp), allocatable :: row(:, :)
   contains
      procedure(bend), deferred :: bend
   end type flexible_beam_t

   abstract interface
      !> Static displacements under loads, on an elastic foundation of so many times the mass.
      pure subroutine bend(self, foundation, load, shape, error)
         import :: failure_t, flexible_beam_t, wp
         implicit none (type, external)
         class(flexible_beam_t), intent(in) :: self
         !> 0: there is no foundation
         real(wp), intent(in) :: foundation
         !> [coordinates, loads]
         real(wp), intent(in) :: load(:, :)
         !> [coordinates, loads]
         real(wp), intent(out) :: shape(:, :)
         !> Set when they cannot be found
         type(failure_t), allocatable, intent(inout) :: error
      end subroutine bend
   end interface

contains

   !> At rest on the contacts that carry the beam: they push and never pull, and yield in a row with it.
   pure subroutine carry(beam, contacts, is_active, displacement, forces, error)
      class(flexible_beam_t), intent(in) :: beam
      type(contact_t), intent(in) :: contacts(:)
      !> Those that can carry it
      logical, intent(in) :: is_active(:)
      !> Under the loads without contacts; with those that carry it on return, [coordinates]
      real(wp), intent(inout) :: displacement(:)
      !> P of each
      real(wp), intent(inout) :: forces(:)
      !> Set when the shapes cannot be found
      type(failure_t), allocatable, intent(inout) :: error

      real(wp) :: shape(size(displacement), count(is_active)), compliance(count(is_active), count(is_active)), &
         push(count(is_active))
      integer :: place(count(is_active)), k

      place = pack([(k, k=1, size(is_active))], is_active)
      call beam%bend(0.0_wp, beam%row(:, place), shape, error)
      if (allocated(error)) return
      compliance = matmul(transpose(beam%row(:, place)), shape)
      call find_carrying_forces(contacts(place), matmul(displacement, beam%row(:, place)) - contacts(place)%height, &
         compliance, push)
      displacement = displacement + matmul(shape, push)
      forces(place) = push
   end subroutine carry

   !> Forces that push and never pull, of contacts that yield in a row with the beam.
   pure subroutine find_carrying_forces(contacts, gap, compliance, forces)
      !> Those that can carry it
      type(contact_t), intent(in) :: contacts(:)
      !> Without their forces
      real(wp), intent(in) :: gap(:)
      !> Of the beam; of the contacts, too, on return, [surfaces, surfaces]
      real(wp), intent(inout) :: compliance(:, :)
      !> P of each
      real(wp), intent(out) :: forces(:)

      real(wp) :: stiffness
      logical :: carries(size(gap))
      integer :: k

      do k = 1, size(gap)
         stiffness = static_stiffness(contacts(k)%settings)
         if (stiffness > 0.0_wp) compliance(k, k) = compliance(k, k) + 1.0_wp/stiffness
      end do
      call solve_complementarity(compliance, gap, forces, carries)
   end subroutine find_carrying_forces

   !> Is a contact in the way that does not carry the beam?
   pure subroutine check_start(beam, contacts, forces, displacement, error)
      class(flexible_beam_t), intent(in) :: beam
      type(contact_t), intent(in) :: contacts(:)
      !> P of each
      real(wp), intent(in) :: forces(:)
      !> [coordinates]
      real(wp), intent(in) :: displacement(:)
      !> Set when there is one
      type(failure_t), allocatable, intent(inout) :: error

      real(wp) :: gap(size(contacts))
      integer :: k

      gap = matmul(displacement, beam%row) - contacts%height
      k = findloc(is_beyond(contacts, gap) .and. .not. forces > 0.0_wp, .true., dim=1)
      if (k > 0) call fail(error, status_bad_input, 'the beam starts beyond the surface at '// &
         to_text(contacts(k)%settings%position)//', by '//to_text(-gap(k))//' of the unit of displacement')
   end subroutine check_start

   !> Move what lies beyond contacts, by their tolerance at most, onto them: along shapes that a force there gives a
   !> beam on an elastic foundation, so that one that turns freely has them, too.
   pure subroutine move_onto_contacts(beam, contacts, is_active, forces, displacement, error)
      class(flexible_beam_t), intent(in) :: beam
      type(contact_t), intent(in) :: contacts(:)
      !> Those that can be met
      logical, intent(in) :: is_active(:)
      !> P of each; those that carry the beam may be entered
      real(wp), intent(in) :: forces(:)
      !> [coordinates]
      real(wp), intent(inout) :: displacement(:)
      !> Set when the shapes cannot be found
      type(failure_t), allocatable, intent(inout) :: error

      real(wp), dimension(size(is_active)) :: gap, noise, shift
      real(wp) :: shape(size(displacement), size(is_active))
      integer, allocatable :: place(:)
      integer :: k

      gap = matmul(displacement, beam%row) - contacts%height
      noise = 4.0_wp*epsilon(1.0_wp)*(abs(contacts%height) + matmul(abs(displacement), abs(beam%row)))
      place = pack([(k, k=1, size(is_active))], is_active .and. .not. (forces > 0.0_wp .or. is_beyond(contacts, gap)))
      associate (n => size(place))
         if (all(gap(place) >= -noise(place))) return
         call beam%bend(1.0_wp, beam%row(:, place), shape(:, :n), error)
         if (allocated(error)) return
         call close_gaps(matmul(transpose(beam%row(:, place)), shape(:, :n)), gap(place), noise(place), shift(:n))
         displacement = displacement + matmul(shape(:, :n), shift(:n))
      end associate
   end subroutine move_onto_contacts

end module contact_starts
