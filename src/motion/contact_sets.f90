!> A set of closed surfaces, and the motion of a beam on it in closed form: rigid ones hold it, those that yield press
!> on it (docs/theory.md, section 17). Made at first use and kept.
module contact_sets
   use contact_losses, only: integral
   use damped_oscillators, only: propagate, sampler_t
   use failures, only: failure_t
   use held_sets, only: free_beam_t, held_set_t, make_held_set
   use joint_modes, only: joint_modes_t, make_joint_modes
   use kinds, only: wp
   use sorting, only: ascending_order
   use yielding_stop, only: impedance_t
   implicit none (type, external)
   private
   public :: contact_set_t, set_store_t, find_set, losses_in, state_in, ready_for_losses

   type :: contact_set_t
      !> Which surfaces are closed, [surfaces]
      logical, allocatable :: is_closed(:)
      !> The beam held at the rigid ones
      type(held_set_t) :: held
      !> Those that yield, and the terms of the motion on them
      integer, allocatable :: pressed(:)
      type(joint_modes_t) :: joint
      !> Terms of gaps, reactions and tip per unit of amplitude, [surfaces, count], [held, count], [count]
      complex(wp), allocatable :: gap(:, :), reaction(:, :), tip(:)
      !> At rest: modes of the held beam, forces on those that yield, gaps, reactions, tip
      real(wp), allocatable :: rest(:), rest_force(:), rest_gap(:), rest_reaction(:)
      real(wp) :: rest_tip = 0.0_wp
      !> Places of the terms, the fastest last
      integer, allocatable :: place(:)
      !> Goes through the samples of phases without terms
      type(sampler_t) :: sampler
      !> Dissipation per pair of terms, in the beam and in each that yields: power = Re sum (plain A_m A_n + conjugate
      !> A_m conj(A_n))/2, [count, count, 1 + pressed]
      complex(wp), allocatable :: plain(:, :, :), conjugate(:, :, :)
   end type contact_set_t

   type :: set_place_t
      type(contact_set_t), pointer :: set => null()
   end type set_place_t

   !> The sets of a run; the least recently made goes when there are too many.
   type :: set_store_t
      type(set_place_t), allocatable :: place(:)
      integer :: count = 0
   contains
      final :: empty
   end type set_store_t

   !> So many sets are kept: four stops on both sides have 81.
   integer, parameter :: most_sets = 128

contains

   !> The set of these closed surfaces, made if there is none yet.
   subroutine find_set(beam, is_rigid, spring, is_closed, store, set, is_new, error)
      type(free_beam_t), intent(in) :: beam
      !> Of each surface, [surfaces]
      logical, intent(in) :: is_rigid(:)
      !> Meant where it yields, [surfaces]
      type(impedance_t), intent(in) :: spring(:)
      logical, intent(in) :: is_closed(:)
      type(set_store_t), intent(inout) :: store
      type(contact_set_t), pointer, intent(out) :: set
      logical, intent(out) :: is_new
      !> Set when the exponents are not found
      type(failure_t), allocatable, intent(inout) :: error

      integer :: i

      is_new = .false.
      if (.not. allocated(store%place)) allocate (store%place(most_sets))
      do i = 1, min(store%count, most_sets)
         set => store%place(i)%set
         if (all(set%is_closed .eqv. is_closed)) return
      end do
      is_new = .true.
      allocate (set)
      i = modulo(store%count, most_sets) + 1
      if (associated(store%place(i)%set)) deallocate (store%place(i)%set)
      store%place(i)%set => set
      store%count = store%count + 1
      call make_set(beam, is_rigid, spring, is_closed, set, error)
   end subroutine find_set

   !> Give the sets back.
   subroutine empty(store)
      type(set_store_t), intent(inout) :: store

      integer :: i

      if (.not. allocated(store%place)) return
      do i = 1, size(store%place)
         if (associated(store%place(i)%set)) deallocate (store%place(i)%set)
      end do
      deallocate (store%place)
   end subroutine empty

   subroutine make_set(beam, is_rigid, spring, is_closed, set, error)
      type(free_beam_t), intent(in) :: beam
      logical, intent(in) :: is_rigid(:)
      type(impedance_t), intent(in) :: spring(:)
      logical, intent(in) :: is_closed(:)
      type(contact_set_t), target, intent(inout) :: set
      !> Set when the exponents are not found
      type(failure_t), allocatable, intent(inout) :: error

      real(wp), allocatable :: heights(:)
      integer :: i, m

      allocate (set%is_closed, source=is_closed)
      call make_held_set(beam, pack([(i, i=1, size(is_closed))], is_closed .and. is_rigid), set%held)
      allocate (set%pressed, source=pack([(i, i=1, size(is_closed))], is_closed .and. .not. is_rigid))
      if (size(set%pressed) == 0) return
      call make_joint_modes(set%held%oscillators, set%held%value(:, set%pressed), spring(set%pressed), set%joint, error)
      if (allocated(error)) return
      associate (held => set%held, joint => set%joint, n => set%joint%count)
         ! heights above the state of rest of the held beam
         allocate (heights, source=-held%static_gap(set%pressed))
         allocate (set%rest_force, source=matmul(joint%static_force, heights))
         allocate (set%rest, source=matmul(joint%static_shape, heights))
         allocate (set%rest_gap, source=held%static_gap + matmul(set%rest, held%value))
         allocate (set%rest_reaction, source=held%static_force + matmul(held%reaction, set%rest) &
            - matmul(held%share(:, set%pressed), set%rest_force))
         set%rest_tip = held%static_tip + sum(held%tip_value*set%rest)
         allocate (set%gap(size(is_closed), n), set%reaction(size(held%held), n), set%tip(n))
         do m = 1, n
            set%gap(:, m) = matmul(joint%shape(:, m), held%value)
            set%gap(set%pressed, m) = -joint%indentation(:, m)
            set%gap(held%held, m) = 0.0_wp
            set%reaction(:, m) = matmul(held%reaction, joint%shape(:, m))*joint%viscous(m) &
               - matmul(held%share(:, set%pressed), joint%force(:, m))
            set%tip(m) = sum(held%tip_value*joint%shape(:, m))
         end do
         allocate (set%place, source=ascending_order(abs(joint%exponent)))
      end associate
   end subroutine make_set

   !> State of the held beam's modes on surfaces that yield.
   pure subroutine state_in(set, amplitude, z0, v0, time, z, v)
      type(contact_set_t), intent(in) :: set
      !> With the weight, [count]
      complex(wp), intent(in) :: amplitude(:)
      !> State at the start; only modes with nodes at those surfaces are read, [modes]
      real(wp), intent(in) :: z0(:)
      real(wp), intent(in) :: v0(:)
      !> Since the start
      real(wp), intent(in) :: time
      real(wp), intent(out) :: z(:)
      real(wp), intent(out) :: v(:)

      real(wp), dimension(size(z0)) :: alone, alone_rate
      complex(wp) :: factor
      integer :: m

      z = set%rest
      v = 0.0_wp
      do m = 1, set%joint%count
         factor = amplitude(m)*exp(set%joint%exponent(m)*time)
         z = z + real(factor*set%joint%shape(:, m), wp)
         v = v + real(factor*set%joint%exponent(m)*set%joint%shape(:, m), wp)
      end do
      if (size(set%joint%inactive) == 0) return
      call propagate(set%held%oscillators, time, z0, v0, alone, alone_rate)
      z(set%joint%inactive) = alone(set%joint%inactive)
      v(set%joint%inactive) = alone_rate(set%joint%inactive)
   end subroutine state_in

   !> What the ledger needs of each pair of terms.
   pure subroutine ready_for_losses(set)
      type(contact_set_t), intent(inout) :: set

      complex(wp), allocatable :: rate(:, :), stop_rate(:, :)
      integer :: j, m, n

      if (allocated(set%plain) .or. size(set%pressed) == 0) return
      associate (joint => set%joint, k => set%joint%count)
         allocate (set%plain(k, k, 1 + size(set%pressed)), set%conjugate(k, k, 1 + size(set%pressed)))
         allocate (rate(set%held%count, k), stop_rate(size(set%pressed), k))
         do m = 1, k
            rate(:, m) = sqrt(joint%two_zeta*set%held%oscillators%square)*joint%exponent(m)*joint%shape(:, m)
            do j = 1, size(set%pressed)
               associate (spring => joint%spring(j))
                  if (spring%branch_stiffness > 0.0_wp) then
                     stop_rate(j, m) = sqrt(spring%relaxation_rate/spring%branch_stiffness)*joint%branch(j, m)
                  else
                     stop_rate(j, m) = sqrt(spring%viscosity)*joint%exponent(m)*joint%indentation(j, m)
                  end if
               end associate
            end do
         end do
         do n = 1, k
            do m = 1, k
               set%plain(m, n, 1) = sum(rate(:, m)*rate(:, n))
               set%conjugate(m, n, 1) = sum(rate(:, m)*conjg(rate(:, n)))
               set%plain(m, n, 2:) = stop_rate(:, m)*stop_rate(:, n)
               set%conjugate(m, n, 2:) = stop_rate(:, m)*conjg(stop_rate(:, n))
            end do
         end do
      end associate
   end subroutine ready_for_losses

   !> Dissipated up to a time in the beam and in each surface that yields.
   pure subroutine losses_in(set, amplitude, z0, v0, time, lost)
      !> Ready for it
      type(contact_set_t), intent(in) :: set
      !> With the weight, [count]
      complex(wp), intent(in) :: amplitude(:)
      !> State at the start, [modes]
      real(wp), intent(in) :: z0(:)
      real(wp), intent(in) :: v0(:)
      real(wp), intent(in) :: time
      !> [1 + pressed]
      real(wp), intent(out) :: lost(:)

      complex(wp) :: plain, conjugate, pair, factor(set%joint%count)
      real(wp), dimension(size(z0)) :: z, v
      integer :: m, n

      lost = 0.0_wp
      associate (s => set%joint%exponent)
         factor = exp(s*time)
         do n = 1, set%joint%count
            ! both forms are symmetric in the two terms, up to conjugation
            do m = 1, n
               pair = merge(0.5_wp, 1.0_wp, m == n)*amplitude(m)*amplitude(n)
               plain = pair*integral(s(m) + s(n), time, factor(m)*factor(n))
               pair = merge(0.5_wp, 1.0_wp, m == n)*amplitude(m)*conjg(amplitude(n))
               conjugate = pair*integral(s(m) + conjg(s(n)), time, factor(m)*conjg(factor(n)))
               lost = lost + real(set%plain(m, n, :)*plain + set%conjugate(m, n, :)*conjugate, wp)
            end do
         end do
      end associate
      if (size(set%joint%inactive) == 0) return
      call propagate(set%held%oscillators, time, z0, v0, z, v)
      associate (i => set%joint%inactive, w2 => set%held%oscillators%square)
         lost(1) = lost(1) + 0.5_wp*sum(v0(i)**2 - v(i)**2 + w2(i)*(z0(i)**2 - z(i)**2))
      end associate
   end subroutine losses_in

end module contact_sets
