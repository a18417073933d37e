!> The terms of a contact with several stops (docs/theory.md, sections 17 and 18).
module joint_terms
   use kinds, only: wp
   use sorting, only: ascending_order
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: joint_modes_t, make_room, add_room, put_in_order

   type :: joint_modes_t
      !> The stops
      type(impedance_t), allocatable :: spring(:)
      real(wp) :: two_zeta = 0.0_wp
      !> alpha, [modes of the beam]
      real(wp), allocatable :: mass_rate(:)
      !> Number of terms; of a conjugate pair only the one with Im s > 0 is kept
      integer :: count = 0
      !> Exponents s, and 1 for a real one, 2 for a pair, [count]
      complex(wp), allocatable :: exponent(:)
      real(wp), allocatable :: weight(:)
      !> -Re s and Im s, filled up with zeros to whole vectors
      real(wp), allocatable :: decay(:), swing(:)
      !> P of each stop, its indentation and its P2 per unit of amplitude, [stops, count]
      complex(wp), allocatable :: force(:, :), indentation(:, :), branch(:, :)
      !> Each mode of the beam per unit of amplitude, [modes, count], and 1 + 2 zeta s, [count]
      complex(wp), allocatable :: shape(:, :), viscous(:)
      !> What makes the amplitude of the state at the start: of heights, of what the stops keep, [stops, count], and of
      !> the modes, [modes, count]
      complex(wp), allocatable :: of_height(:, :), of_memory(:, :), of_mode(:, :)
      !> Modes with nodes at all stops: they swing on as if alone
      integer, allocatable :: inactive(:)
      !> Displacement and force of the state of rest per unit of height, [modes, stops], [stops, stops]
      real(wp), allocatable :: static_shape(:, :), static_force(:, :)
   end type joint_modes_t

contains

   !> Room for some terms.
   pure subroutine make_room(modes, beam, stops, most)
      type(joint_modes_t), intent(inout) :: modes
      !> Modes of the beam
      integer, intent(in) :: beam
      integer, intent(in) :: stops
      !> Terms at most
      integer, intent(in) :: most

      if (allocated(modes%exponent)) deallocate (modes%exponent, modes%weight, modes%viscous, modes%force, &
         modes%indentation, modes%branch, modes%of_height, modes%of_memory, modes%shape, modes%of_mode)
      allocate (modes%exponent(most), modes%weight(most), modes%viscous(most))
      allocate (modes%force(stops, most), modes%indentation(stops, most), modes%branch(stops, most), &
         modes%of_height(stops, most), modes%of_memory(stops, most), modes%shape(beam, most), &
         modes%of_mode(beam, most), source=(0.0_wp, 0.0_wp))
   end subroutine make_room

   !> Room for so many more.
   pure subroutine add_room(modes, more)
      type(joint_modes_t), intent(inout) :: modes
      integer, intent(in) :: more

      type(joint_modes_t) :: old

      old = modes
      call make_room(modes, size(old%shape, 1), size(old%force, 1), size(old%exponent) + more)
      associate (n => old%count)
         modes%exponent(:n) = old%exponent(:n)
         modes%weight(:n) = old%weight(:n)
         modes%viscous(:n) = old%viscous(:n)
         modes%force(:, :n) = old%force(:, :n)
         modes%indentation(:, :n) = old%indentation(:, :n)
         modes%branch(:, :n) = old%branch(:, :n)
         modes%of_height(:, :n) = old%of_height(:, :n)
         modes%of_memory(:, :n) = old%of_memory(:, :n)
         modes%shape(:, :n) = old%shape(:, :n)
         modes%of_mode(:, :n) = old%of_mode(:, :n)
      end associate
   end subroutine add_room

   !> Keep the room that is used, the fastest terms last, which lets the steps of searches be long.
   pure subroutine put_in_order(modes)
      type(joint_modes_t), intent(inout) :: modes

      integer :: order(modes%count)

      order = ascending_order(abs(modes%exponent(:modes%count)))
      modes%exponent = modes%exponent(order)
      modes%weight = modes%weight(order)
      modes%viscous = modes%viscous(order)
      modes%force = modes%force(:, order)
      modes%indentation = modes%indentation(:, order)
      modes%branch = modes%branch(:, order)
      modes%of_height = modes%of_height(:, order)
      modes%of_memory = modes%of_memory(:, order)
      modes%shape = modes%shape(:, order)
      modes%of_mode = modes%of_mode(:, order)
   end subroutine put_in_order

end module joint_terms
