!> Impacts at one instant, for every integration method: Newton's impact law with coefficients of restitution eps as one
!> linear complementarity problem over the rigid contacts that take part (docs/theory.md, sections 7, 10 and 17); and
!> the impulse of an impact that replaces the velocity of one node alone.
!>
!> The integration method supplies velocities and the mobility matrix, and applies the impulses. If these impulses make
!> the beam approach a contact again from which it was separating, the method poses another problem at the same instant.
module impact_problem
   use complementarity, only: solve_complementarity
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: impact_contact_t, rebounds, comes_to_rest, stays_closed, unchanged, is_hit, is_arrested, gets_impulse, &
      is_released
   public :: max_rounds, add_impact_contact, find_impulses, find_nodal_impulse, outcome_of

   !> Maximum number of impact problems at one instant; in the last one every contact that the beam touches comes to
   !> rest, so that the sequence ends.
   integer, parameter :: max_rounds = 100

   !> Role of a contact that rebounds by its coefficient of restitution; it takes part only if the beam approaches it.
   integer, parameter :: rebounds = 1
   !> Role of a contact without restitution, also if the beam separates from it (capture).
   integer, parameter :: comes_to_rest = 2
   !> Role of a contact that is closed already.
   integer, parameter :: stays_closed = 3

   !> Outcome for a contact that receives no impulse. The outcome of a contact that has received one is its role, so the
   !> next three constants are equal to those of the roles.
   integer, parameter :: unchanged = 0
   !> Outcome: an impact.
   integer, parameter :: is_hit = rebounds
   !> Outcome: a capture.
   integer, parameter :: is_arrested = comes_to_rest
   !> Outcome: an impulse on a closed contact.
   integer, parameter :: gets_impulse = stays_closed
   !> Outcome: a closed contact opens without an impulse of its own.
   integer, parameter :: is_released = 4

   !> A rigid contact in the impact problem.
   type :: impact_contact_t
      !> Index among all contacts
      integer :: contact = 0
      !> Role in the problem, one of the constants above
      integer :: role = rebounds
      !> Coefficient of restitution of the contact
      real(wp) :: restitution = 0.0_wp
      !> Normal velocity of the beam before the impulse, positive away from the contact
      real(wp) :: before = 0.0_wp
      !> Normal velocity of the beam after the impulse
      real(wp) :: after = 0.0_wp
      !> Impulse on the beam, positive away from the contact
      real(wp) :: impulse = 0.0_wp
      !> Change of the beam's energy by the impulse
      real(wp) :: energy_change = 0.0_wp
   end type impact_contact_t

contains

   !> Add a contact that the beam touches to the problem, unless it would rebound and the beam separates from it. The
   !> normal velocity at a closed contact is exactly zero.
   pure subroutine add_impact_contact(contact, role, velocity, restitution, struck, count)
      !> Index among all contacts
      integer, intent(in) :: contact
      !> Role in the problem, one of the constants above
      integer, intent(in) :: role
      !> Normal velocity of the beam, positive away from the contact
      real(wp), intent(in) :: velocity
      !> Coefficient of restitution of the contact
      real(wp), intent(in) :: restitution
      type(impact_contact_t), intent(inout) :: struck(:)
      !> Number of contacts in the problem
      integer, intent(inout) :: count

      if (role == rebounds .and. velocity > 0.0_wp) return
      count = count + 1
      struck(count) = impact_contact_t(contact, role, merge(restitution, 0.0_wp, role == rebounds), &
         merge(0.0_wp, velocity, role == stays_closed))
   end subroutine add_impact_contact

   !> Solve for impulses Lambda >= 0 complementary to w+ + eps w- >= 0, with the normal velocities w- before and w+ = w-
   !> + W Lambda after the impulses. The energy of the beam does not increase.
   pure subroutine find_impulses(mobility, struck, value)
      !> Mobility W: normal velocity at one contact per unit impulse at another, symmetric, [struck, struck]
      real(wp), intent(in) :: mobility(:, :)
      !> Contacts of the problem, which receive impulses and velocities after them
      type(impact_contact_t), intent(inout) :: struck(:)
      !> Values of the modes at all contacts, whose products are W, [modes, contacts]; absent: W alone is known
      real(wp), intent(in), optional :: value(:, :)

      real(wp) :: impulse(size(struck))
      logical :: is_active(size(struck))

      call solve_complementarity(mobility, struck%before + struck%restitution*struck%before, impulse, is_active, &
         value=value, place=struck%contact)
      struck%impulse = impulse
      struck%after = merge(-struck%restitution*struck%before, struck%before + matmul(mobility, impulse), is_active)
      struck%energy_change = 0.5_wp*impulse*(struck%before + struck%after)
   end subroutine find_impulses

   !> Replacement of the nodal velocity: one node gets the velocity after the impact, all other nodes keep theirs. The
   !> energy may increase.
   pure subroutine find_nodal_impulse(mass, momentum, struck)
      !> Mass M_cc of the degree of freedom c of the node
      real(wp), intent(in) :: mass
      !> Momentum (M v)_c of that degree of freedom before the impact
      real(wp), intent(in) :: momentum
      type(impact_contact_t), intent(inout) :: struck

      struck%after = -struck%restitution*struck%before
      associate (jump => struck%after - struck%before)
         struck%impulse = mass*jump
         struck%energy_change = jump*(momentum + 0.5_wp*mass*jump)
      end associate
   end subroutine find_nodal_impulse

   !> Outcome of the impulses for a contact.
   elemental integer function outcome_of(struck, rounding) result(outcome)
      type(impact_contact_t), intent(in) :: struck
      !> Rounding error of the velocity
      real(wp), intent(in) :: rounding

      outcome = unchanged
      if (struck%impulse > 0.0_wp) then
         outcome = struck%role
      else if (struck%after > rounding) then
         outcome = is_released
      end if
   end function outcome_of

end module impact_problem
