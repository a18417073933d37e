!> Impacts at one instant, for any way through time: Newton's law with coefficients of restitution as one
!> complementarity problem over the rigid contacts that take part (docs/theory.md, sections 7, 10 and 17).
!>
!> A way through time supplies velocities and the mobility matrix, applies the impulses, and asks again as long as the
!> impulses turn a contact back that had left.
module impact_problem
   use complementarity, only: solve_complementarity
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: struck_t, rebounds, comes_to_rest, holds, unchanged, is_hit, is_arrested, is_pushed, is_thrown_off
   public :: most_rounds, take_part, find_impulses, find_nodal_impulse, outcome_of

   !> So many problems at one instant; in the last one every contact that the beam touches comes to rest.
   integer, parameter :: most_rounds = 100

   !> How a contact takes part: by its coefficient of restitution; without one, also where the beam leaves it; or it
   !> holds the beam already.
   integer, parameter :: rebounds = 1
   integer, parameter :: comes_to_rest = 2
   integer, parameter :: holds = 3

   !> What the impulses make of it: nothing; an impact; a capture; an impulse on a contact that holds the beam; or, with
   !> no impulse of its own, the beam leaves it.
   integer, parameter :: unchanged = 0
   integer, parameter :: is_hit = rebounds
   integer, parameter :: is_arrested = comes_to_rest
   integer, parameter :: is_pushed = holds
   integer, parameter :: is_thrown_off = 4

   !> A contact that takes part.
   type :: struck_t
      !> Its place among all
      integer :: contact = 0
      !> How it takes part, one of the constants above
      integer :: part = rebounds
      real(wp) :: restitution = 0.0_wp
      !> Velocity of the stop point away from the contact
      real(wp) :: before = 0.0_wp
      real(wp) :: after = 0.0_wp
      !> What it gives the beam, and the energy that the beam gets by it
      real(wp) :: impulse = 0.0_wp
      real(wp) :: energy_change = 0.0_wp
   end type struck_t

contains

   !> A contact that the beam touches enters the problem, unless it can rebound and the beam leaves it.
   pure subroutine take_part(contact, part, velocity, restitution, struck, count)
      !> Its place among all
      integer, intent(in) :: contact
      !> One of the constants above
      integer, intent(in) :: part
      !> Away from it
      real(wp), intent(in) :: velocity
      real(wp), intent(in) :: restitution
      type(struck_t), intent(inout) :: struck(:)
      !> So many have entered
      integer, intent(inout) :: count

      if (part == rebounds .and. velocity > 0.0_wp) return
      count = count + 1
      struck(count) = struck_t(contact, part, merge(restitution, 0.0_wp, part == rebounds), &
         merge(0.0_wp, velocity, part == holds))
   end subroutine take_part

   !> Impulses that push, w+ = w- + W Lambda >= -eps w-, complementary. No energy is won.
   pure subroutine find_impulses(mobility, struck)
      !> W, velocity at one contact under a unit impulse at another, symmetric, [struck, struck]
      real(wp), intent(in) :: mobility(:, :)
      !> Get impulses and velocities after
      type(struck_t), intent(inout) :: struck(:)

      real(wp) :: impulse(size(struck))
      logical :: is_active(size(struck))

      call solve_complementarity(mobility, struck%before + struck%restitution*struck%before, impulse, is_active)
      struck%impulse = impulse
      struck%after = merge(-struck%restitution*struck%before, struck%before + matmul(mobility, impulse), is_active)
      struck%energy_change = 0.5_wp*impulse*(struck%before + struck%after)
   end subroutine find_impulses

   !> The nodal reading of an impulse: one node gets the velocity after, and all others keep theirs. Energy may be won.
   pure subroutine find_nodal_impulse(mass, momentum, struck)
      !> Of the node: M_cc, and (M v)_c before
      real(wp), intent(in) :: mass
      real(wp), intent(in) :: momentum
      type(struck_t), intent(inout) :: struck

      struck%after = -struck%restitution*struck%before
      associate (jump => struck%after - struck%before)
         struck%impulse = mass*jump
         struck%energy_change = jump*(momentum + 0.5_wp*mass*jump)
      end associate
   end subroutine find_nodal_impulse

   !> What the impulses made of a contact.
   elemental function outcome_of(struck, noise) result(outcome)
      type(struck_t), intent(in) :: struck
      !> Rounding error of its velocity
      real(wp), intent(in) :: noise
      integer :: outcome

      outcome = unchanged
      if (struck%impulse > 0.0_wp) then
         outcome = struck%part
      else if (struck%after > noise) then
         outcome = is_thrown_off
      end if
   end function outcome_of

end module impact_problem
